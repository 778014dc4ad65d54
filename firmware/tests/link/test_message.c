/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdint.h>
#include <string.h>

#include "lib/bytes.h"
#include "link/protocol/message.h"
#include "litestereo/crc32.h"
#include "require.h"

static uint8_t buffer[PROTOCOL_MESSAGE_MAX + 1];

static size_t build(uint32_t length)
{
    static uint8_t payload[PROTOCOL_CHUNK_SIZE];
    message_t      message = {
        .version = 1, .type = TYPE_UPLOAD, .session = 0x11223344, .sequence = 0x55667788, .frame_id = 0x99aabbcc,
        .offset = 0xddeeff01, .length = length, .payload = payload,
    };

    for (uint32_t i = 0; i < length; i++) {
        payload[i] = (uint8_t)(i * 7);
    }
    return message_build(&message, buffer);
}

/* Recomputes the CRC, so that only the tested field is wrong. */
static void seal(size_t length)
{
    put_u32(buffer + length - 4, crc32_update(0, buffer, length - 4));
}

static void test_round_trip(void)
{
    static const uint32_t lengths[] = {0, 1, 4, 52, 1023, 1024};
    message_t             message;

    for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
        size_t length = build(lengths[i]);

        REQUIRE(length == 28 + lengths[i]);
        REQUIRE(message_parse(buffer, length, &message) == STATUS_OK);
        REQUIRE(message.version == 1 && message.type == TYPE_UPLOAD && message.session == 0x11223344);
        REQUIRE(message.sequence == 0x55667788 && message.frame_id == 0x99aabbcc && message.offset == 0xddeeff01);
        REQUIRE(message.length == lengths[i] && message.payload == buffer + 24);
        for (uint32_t j = 0; j < lengths[i]; j++) {
            REQUIRE(message.payload[j] == (uint8_t)(j * 7));
        }
    }
}

static void test_layout(void)
{
    static const uint8_t header[] = {
        'L', 'S', 1, 4, 0x44, 0x33, 0x22, 0x11, 0x88, 0x77, 0x66, 0x55,
        0xcc, 0xbb, 0xaa, 0x99, 0x01, 0xff, 0xee, 0xdd, 2, 0, 0, 0, 0, 7,
    };

    REQUIRE(build(2) == 30 && memcmp(buffer, header, sizeof(header)) == 0);
}

static void test_refusals(void)
{
    message_t message = {.type = 0x55};
    size_t    length  = build(100);

    REQUIRE(message_parse(buffer, 27, &message) == STATUS_FRAMING);
    REQUIRE(message_parse(buffer, PROTOCOL_MESSAGE_MAX + 1, &message) == STATUS_FRAMING);
    REQUIRE(message_parse(buffer, length - 1, &message) == STATUS_HEADER);
    REQUIRE(message_parse(buffer, length + 1, &message) == STATUS_HEADER);
    for (uint32_t wrong = 0; wrong < 2000; wrong++) {
        put_u32(buffer + HEADER_LENGTH, wrong);
        seal(length);
        REQUIRE(message_parse(buffer, length, &message) == (wrong == 100 ? STATUS_OK : STATUS_HEADER));
    }
    put_u32(buffer + HEADER_LENGTH, 0xffffffe4);
    seal(length);
    REQUIRE(message_parse(buffer, length, &message) == STATUS_HEADER);
    build(100);
    buffer[0] = 'M';
    seal(length);
    REQUIRE(message_parse(buffer, length, &message) == STATUS_HEADER);
    /* A change of any single bit is detected. */
    for (size_t bit = 0; bit < 8 * length; bit++) {
        build(100);
        message.type = 0x55;
        buffer[bit / 8] ^= (uint8_t)(1 << bit % 8);
        REQUIRE(message_parse(buffer, length, &message) != STATUS_OK && message.type == 0x55);
    }
}

int main(void)
{
    test_round_trip();
    test_layout();
    test_refusals();
    return 0;
}
