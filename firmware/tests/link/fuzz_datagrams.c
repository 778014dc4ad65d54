/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fuzz_datagrams.h"

#include <string.h>

#include "generated/csr.h"
#include "lib/bytes.h"
#include "link/protocol/message.h"
#include "litestereo/crc32.h"
#include "require.h"

#define NOISE 65536u
#define PEERS 3u

static uint8_t noise[NOISE + PROTOCOL_CHUNK_SIZE];

void fuzz_prepare(unsigned *random)
{
    for (size_t i = 0; i < sizeof(noise); i++) {
        noise[i] = (uint8_t)(next_random(random) >> 9);
    }
}

const uint8_t *fuzz_chunk(uint32_t frame_id, uint32_t offset)
{
    return noise + (frame_id * 9973u + offset / PROTOCOL_CHUNK_SIZE * 1013u) % NOISE;
}

static bool has_pixels(uint8_t type)
{
    return type == TYPE_UPLOAD || type == TYPE_PAIRS;
}

static bool one_in(unsigned *random, unsigned number)
{
    return next_random(random) % number == 0;
}

/* A number of any size, often one near a border. */
static uint32_t odd_number(unsigned *random)
{
    static const uint32_t borders[] = {0, 1, 1023, 1024, 1025, 2048, 0x7fffffff, 0x80000000, 0xfffffc00, 0xffffffff};

    return one_in(random, 2) ? borders[next_random(random) % 10] : next_random(random) >> next_random(random) % 32;
}

/* Pairs of the frame being matched, mostly the next ones. */
static void fill_pairs(unsigned *random, const session_t *session, message_t *message)
{
    const frame_t *frame = frame_pool_matching(session->pool);

    message->offset = one_in(random, 4) ? next_random(random) % 10 * PROTOCOL_CHUNK_SIZE
                                        : frame_link_stream_offset_read();
    message->length = PROTOCOL_CHUNK_SIZE;
    if (frame != NULL && !one_in(random, 16)) {
        uint32_t size = frame_map_size(frame);
        uint32_t rest = message->offset < size ? size - message->offset : PROTOCOL_CHUNK_SIZE;

        message->frame_id = frame->id;
        message->length   = rest < PROTOCOL_CHUNK_SIZE ? rest : PROTOCOL_CHUNK_SIZE;
    }
}

/* Fills in plausible arguments of a request; writes its payload to `payload` and the length to the message. */
static void fill_request(unsigned *random, const session_t *session, message_t *message, uint8_t *payload)
{
    const frame_t *frame = frame_pool_find(session->pool, FRAME_OWNER_LINK, message->frame_id);

    switch (message->type) {
    case TYPE_HELLO:
        put_u32(payload, next_random(random) % 8);
        message->length = 4;
        break;
    case TYPE_CONFIGURE:
        message->length = 8 * (next_random(random) % 3);
        for (uint32_t at = 0; at < message->length; at += 8) {
            put_u16(payload + at, (uint16_t)(next_random(random) % 12));
            put_u16(payload + at + 2, 0);
            put_u32(payload + at + 4, one_in(random, 4) ? odd_number(random) : 16);
        }
        break;
    case TYPE_STREAM:
        if (one_in(random, 8)) {
            message->sequence = session->departed[next_random(random) % SESSION_DEPARTED];
        }
        /* fall through */
    case TYPE_OPEN:
        put_u16(payload, (uint16_t)(one_in(random, 64) ? odd_number(random) : 70 + next_random(random) % 20));
        put_u16(payload + 2, (uint16_t)(one_in(random, 64) ? odd_number(random) : 8 + next_random(random) % 40));
        message->length = 4;
        break;
    case TYPE_UPLOAD:
        message->offset = next_random(random) % 8 * PROTOCOL_CHUNK_SIZE;
        if (frame != NULL && !one_in(random, 16)) {
            message->offset %= 2 * frame->pitch;
        }
        message->length = frame != NULL ? frame_chunk_length(frame, message->offset) : PROTOCOL_CHUNK_SIZE;
        break;
    case TYPE_PAIRS:
        fill_pairs(random, session, message);
        break;
    case TYPE_READ:
        message->offset = next_random(random) % 6 * PROTOCOL_CHUNK_SIZE;
        put_u32(payload, one_in(random, 8) || frame == NULL || message->offset >= frame_map_size(frame)
            ? odd_number(random) : 1 + next_random(random) % (frame_map_size(frame) - message->offset));
        message->length = 4;
        break;
    case TYPE_UPDATE:
        put_u32(payload, one_in(random, 4) ? odd_number(random) : next_random(random) % 0x40000);
        put_u32(payload + 4, next_random(random));
        message->length = 8;
        break;
    case TYPE_IMAGE:
        memcpy(payload, noise, PROTOCOL_CHUNK_SIZE);
        message->offset = next_random(random) % 0x100 * PROTOCOL_CHUNK_SIZE;
        message->length = one_in(random, 4) ? next_random(random) % PROTOCOL_CHUNK_SIZE : PROTOCOL_CHUNK_SIZE;
        break;
    default:
        break;
    }
}

static const uint8_t common[] = {
    TYPE_OPEN, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_START,
    TYPE_START, TYPE_STATUS, TYPE_MISSING, TYPE_READ, TYPE_READ, TYPE_READ, TYPE_STREAM, TYPE_PAIRS, TYPE_PAIRS,
    TYPE_PAIRS, TYPE_PAIRS, TYPE_PAIRS,
};
static const uint8_t rare[]   = {
    TYPE_RELEASE, TYPE_RELEASE, TYPE_RELEASE, TYPE_CONFIGURE, TYPE_UPDATE, TYPE_IMAGE, TYPE_IMAGE, TYPE_WRITE,
    TYPE_PROGRESS,
};
static const uint8_t rarest[] = {
    TYPE_HELLO, TYPE_BYE, TYPE_STATISTICS, TYPE_RESTART, 0x13, 0x81, TYPE_UPLOAD | PROTOCOL_REPLY_BIT,
};

static uint8_t choose_type(unsigned *random, const session_t *session)
{
    if (!session->open && !one_in(random, 4)) {
        return TYPE_HELLO;
    }
    if (one_in(random, 256)) {
        return rarest[next_random(random) % sizeof(rarest)];
    }
    return one_in(random, 32) ? rare[next_random(random) % sizeof(rare)] : common[next_random(random) % sizeof(common)];
}

static void make_request(unsigned *random, const session_t *session, fuzz_datagram_t *datagram)
{
    uint8_t   payload[PROTOCOL_CHUNK_SIZE];
    message_t message = {
        .version  = one_in(random, 128) ? (uint8_t)next_random(random) : PROTOCOL_VERSION,
        .session  = one_in(random, 32) ? odd_number(random) : session->token,
        .sequence = next_random(random),
        .frame_id = one_in(random, 64) ? odd_number(random) : 1 + next_random(random) % FUZZ_FRAMES,
        .payload  = payload,
    };

    message.type = choose_type(random, session);
    fill_request(random, session, &message, payload);
    if (one_in(random, 64)) {
        message.offset = odd_number(random);
    }
    if (has_pixels(message.type)) {
        message.payload = fuzz_chunk(message.frame_id, message.offset);
    } else if (one_in(random, 64)) {
        memcpy(payload, noise, sizeof(payload));
        message.length = next_random(random) % (PROTOCOL_CHUNK_SIZE + 1);
    }
    datagram->length = message_build(&message, datagram->bytes);
}

/* Repairs the checks of a damaged message, so that only its contents are wrong. */
static void seal(fuzz_datagram_t *datagram)
{
    uint8_t *bytes = datagram->bytes;
    uint32_t length;

    if (datagram->length < PROTOCOL_MESSAGE_MIN || datagram->length > PROTOCOL_MESSAGE_MAX) {
        return;
    }
    length = (uint32_t)(datagram->length - PROTOCOL_MESSAGE_MIN);
    put_u16(bytes + HEADER_MAGIC, PROTOCOL_MAGIC);
    put_u32(bytes + HEADER_LENGTH, length);
    if (has_pixels(bytes[HEADER_TYPE])) {
        memcpy(bytes + PROTOCOL_HEADER_SIZE,
            fuzz_chunk(get_u32(bytes + HEADER_FRAME_ID), get_u32(bytes + HEADER_OFFSET)), length);
    }
    put_u32(bytes + PROTOCOL_HEADER_SIZE + length, crc32_update(0, bytes, PROTOCOL_HEADER_SIZE + length));
}

static void damage(unsigned *random, fuzz_datagram_t *datagram)
{
    switch (next_random(random) % 6) {
    case 0:
        datagram->length = next_random(random) % (datagram->length + 1);
        break;
    case 1:
        datagram->length += next_random(random) % (FUZZ_MAX - datagram->length + 1);
        break;
    case 2:
        put_u32(datagram->bytes + 4 * (next_random(random) % 6), odd_number(random));
        break;
    case 3:
        datagram->length = next_random(random) % FUZZ_MAX;
        memcpy(datagram->bytes, noise + next_random(random) % (NOISE - FUZZ_MAX), datagram->length);
        break;
    default:
        datagram->bytes[next_random(random) % datagram->length] ^= (uint8_t)(1u << next_random(random) % 8);
        break;
    }
}

void fuzz_datagram(unsigned *random, const session_t *session, fuzz_datagram_t *datagram)
{
    uint32_t who = next_random(random) % 64;

    datagram->peer = who < PEERS || !session->peer.udp
        ? (peer_t){.udp = true, .address = 0x7f000001, .port = (uint16_t)(4000 + who % PEERS)} : session->peer;
    make_request(random, session, datagram);
    if (one_in(random, 4)) {
        damage(random, datagram);
        if (one_in(random, 2)) {
            seal(datagram);
        }
    }
}
