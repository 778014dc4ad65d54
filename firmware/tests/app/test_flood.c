/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The whole firmware under a flood of bytes; the seed may be given on the command line. */

#include "app_fixture.h"
#include "lib/bytes.h"

/* A length of payload that mostly suits the request. */
static uint32_t likely_length(const message_t *message, unsigned *random)
{
    const frame_t *frame = frame_pool_find(&app.pool, FRAME_OWNER_LINK, message->frame_id);

    if (next_random(random) % 32 == 0) {
        return next_random(random) % (PROTOCOL_CHUNK_SIZE + 1);
    }
    switch (message->type) {
    case TYPE_HELLO:
    case TYPE_OPEN:
    case TYPE_READ:
        return 4;
    case TYPE_UPLOAD:
        return frame != NULL ? frame_chunk_length(frame, message->offset) : PROTOCOL_CHUNK_SIZE;
    default:
        return 0;
    }
}

/* Bytes as a bad line delivers them: noise, pieces of frames, and frames with a changed byte. The valid
 * frames open, load and start frames of pixels, so the noise meets a busy device. */
static size_t make_noise(unsigned *random, uint8_t *bytes)
{
    static const uint8_t types[] = {TYPE_CONFIGURE, TYPE_OPEN, TYPE_OPEN, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD,
        TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_START, TYPE_START, TYPE_STATUS, TYPE_READ, TYPE_READ,
        TYPE_STATISTICS};
    static const uint8_t rare[] = {TYPE_HELLO, TYPE_HELLO, TYPE_RELEASE, TYPE_RELEASE, TYPE_RELEASE, TYPE_BYE, 0x7f,
        0x81};
    uint8_t   payload[PROTOCOL_CHUNK_SIZE], buffer[PROTOCOL_MESSAGE_MAX];
    message_t message = {.version = 1, .payload = payload};
    size_t    length;

    if (next_random(random) % 8 == 0) {
        length = next_random(random) % 600;
        for (size_t i = 0; i < length; i++) {
            bytes[i] = (uint8_t)(next_random(random) >> 7);
        }
        return length;
    }
    message.type     = next_random(random) % 16 == 0 ? rare[next_random(random) % sizeof(rare)]
        : types[next_random(random) % sizeof(types)];
    message.session  = next_random(random) % 32 == 0 ? next_random(random) : app.session.token;
    message.frame_id = 1 + next_random(random) % 2;
    message.offset   = next_random(random) % 4 * 1024 + (next_random(random) % 32 == 0);
    message.length   = likely_length(&message, random);
    for (uint32_t i = 0; i < message.length; i++) {
        payload[i] = (uint8_t)(next_random(random) >> 9);
    }
    if (message.type == TYPE_OPEN) {
        put_u16(payload, 70 + (uint16_t)(next_random(random) % 18));
        put_u16(payload + 2, 7 + (uint16_t)(next_random(random) % 18));
    } else if (message.type == TYPE_READ) {
        put_u32(payload, next_random(random) % 1030);
    }
    bytes[0] = 0;
    length   = 1 + cobs_encode(buffer, message_build(&message, buffer), bytes + 1);
    bytes[length++] = 0;
    if (next_random(random) % 6 == 0) {
        bytes[next_random(random) % length] = (uint8_t)next_random(random);
    }
    return next_random(random) % 20 == 0 ? next_random(random) % length : length;
}

static void test_flood(unsigned seed)
{
    static uint8_t bytes[COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2];
    size_t         total = 0;

    boot();
    for (size_t round = 0; total < 4000000; round++) {
        size_t length = make_noise(&seed, bytes);

        receive(bytes, length);
        total += length;
        fake_stereo.hang      = round / 64 % 8 == 0;
        fake_stereo.bus_error = round / 32 % 8 == 5;
        now += next_random(&seed) % (fake_stereo.hang ? 3 : 64) == 0 ? 2000000 : 0;
        for (unsigned idle = next_random(&seed) % 4; idle > 0; idle--) {
            app_poll(&app);
        }
    }
    /* The test is complete: every counter that the noise can reach has changed. The counters after them are UDP's. */
    for (unsigned counter = 0; counter < COUNTER_SESSIONS_REFUSED; counter++) {
        if (app.counters.value[counter] == 0) {
            fprintf(stderr, "%s has not moved\n", counter_name(counter));
        }
        REQUIRE(app.counters.value[counter] > 0);
    }
    /* And the device still answers. */
    fake_stereo.hang = fake_stereo.bus_error = false;
    now += 2000000;
    app_poll(&app);
    type("\r");
    REQUIRE_TYPE("stats\r", "messages_received: ");
}

int main(int argc, char **argv)
{
    make_memory();
    test_flood(argc > 1 ? (unsigned)strtoul(argv[1], NULL, 0) : 1);
    return 0;
}
