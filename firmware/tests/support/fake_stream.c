/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_stream.h"

#include <stddef.h>
#include <string.h>

#include "fake_frame_link.h"
#include "require.h"

#define CHUNK     PROTOCOL_CHUNK_SIZE
#define BYTES_MAX (1u << 20)  /* Pairs of a frame, and its map. */

/* Parts that are sent per step of time. */
#define PARTS_PER_STEP 2

fake_stream_staged_t fake_stream_staged;

static struct stream {
    bool     open, sending;
    peer_t   peer;
    uint32_t token, frame_id, sequence;
    uint32_t size, taken;  /* Bytes: of all pairs, and of those that have arrived. */
    uint32_t map_size, sent;
    unsigned random;
    uint8_t  pairs[BYTES_MAX];
    uint8_t  map[BYTES_MAX];
} stream = {.random = 1};

void fake_stream_reset(void)
{
    /* The pixels may stay: they are no longer valid. */
    memset(&stream, 0, offsetof(struct stream, pairs));
    stream.random = 1;
}

void fake_stream_open(uint32_t token, const peer_t *peer)
{
    REQUIRE(!stream.open && !stream.sending);
    REQUIRE(fake_stream_staged.pixels > 0 && fake_stream_staged.pixels <= BYTES_MAX / 2);
    stream.open     = true;
    stream.peer     = *peer;
    stream.token    = token;
    stream.frame_id = fake_stream_staged.frame_id;
    stream.sequence = fake_stream_staged.sequence;
    stream.size     = 2 * fake_stream_staged.pixels;
    stream.taken    = 0;
    stream.map_size = stream.sent = 0;
}

/* A link that hangs does not notice either that nothing remains to be sent. */
void fake_stream_close(void)
{
    stream.open  = false;
    stream.taken = stream.size = 0;
    stream.map_size = stream.sent;
    stream.sending  = stream.sending && fake_frame_link.hang;
}

uint8_t fake_stream_status(void)
{
    return (uint8_t)(stream.open | stream.sending << 1);
}

uint32_t fake_stream_offset(void)
{
    return stream.taken;
}

fake_stream_fate_t fake_stream_take(const message_t *message)
{
    uint32_t rest = stream.size - stream.taken;

    if (fake_frame_link.hang || message->frame_id != stream.frame_id
        || message->offset % CHUNK != 0 || message->offset > stream.taken) {
        return FAKE_STREAM_UNFIT;
    }
    if (message->offset < stream.taken) {
        return FAKE_STREAM_REPEATED;
    }
    if (!stream.open || message->length != (rest < CHUNK ? rest : CHUNK)) {
        return FAKE_STREAM_UNFIT;
    }
    memcpy(stream.pairs + stream.taken, message->payload, message->length);
    stream.taken += message->length;
    stream.open   = stream.taken < stream.size;
    return FAKE_STREAM_TAKEN;
}

const uint8_t *fake_stream_pairs(void)
{
    return stream.size > 0 && !stream.open ? stream.pairs : NULL;
}

void fake_stream_map(const void *map, uint32_t size)
{
    REQUIRE(size == stream.size);
    memcpy(stream.map, map, size);
    stream.map_size = size;
    stream.sent     = 0;
    stream.sending  = true;
}

/* At random intervals there is no room for a part. */
static bool is_skipped(void)
{
    return fake_frame_link.skips != 0 && next_random(&stream.random) % fake_frame_link.skips == 0;
}

void fake_stream_advance(bool (*send)(const peer_t *peer, const message_t *message))
{
    for (unsigned count = 0; count < PARTS_PER_STEP && stream.sent < stream.map_size; count++) {
        uint32_t  rest = stream.map_size - stream.sent;
        message_t part = {
            .version  = PROTOCOL_VERSION,
            .type     = TYPE_READ | PROTOCOL_REPLY_BIT,
            .session  = stream.token,
            .sequence = stream.sequence,
            .frame_id = stream.frame_id,
            .offset   = stream.sent,
            .length   = rest < CHUNK ? rest : CHUNK,
            .payload  = stream.map + stream.sent,
        };

        if (!is_skipped() && !send(&stream.peer, &part)) {
            return;
        }
        stream.sent += part.length;
    }
    stream.sending = stream.sent < stream.map_size;
}

bool fake_stream_sending(void)
{
    return stream.sending;
}
