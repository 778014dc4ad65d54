/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reads lines of "name message framed", bytes in hexadecimal, from the file named on the command line. */

#include <stdint.h>
#include <string.h>

#include "link/protocol/cobs.h"
#include "link/protocol/message.h"
#include "require.h"

#define FRAMED_MAX (COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2)

static size_t from_hex(const char *text, uint8_t *bytes, size_t capacity)
{
    size_t length = strlen(text) / 2;

    REQUIRE(strlen(text) % 2 == 0 && length <= capacity);
    for (size_t i = 0; i < length; i++) {
        unsigned value;

        REQUIRE(sscanf(text + 2 * i, "%2x", &value) == 1);
        bytes[i] = (uint8_t)value;
    }
    return length;
}

static void check(const char *name, const uint8_t *message, size_t length, const uint8_t *framed, size_t framed_length)
{
    uint8_t        buffer[FRAMED_MAX];
    cobs_decoder_t decoder;
    message_t      parsed;

    fprintf(stderr, "%s\n", name);
    REQUIRE(framed_length >= 2 && framed[0] == 0 && framed[framed_length - 1] == 0);
    cobs_decoder_init(&decoder, buffer, PROTOCOL_MESSAGE_MAX);
    REQUIRE(cobs_decode(&decoder, framed + 1, framed_length - 1) == framed_length - 2);
    REQUIRE(cobs_decoder_finish(&decoder) == STATUS_OK);
    REQUIRE(decoder.length == length && memcmp(buffer, message, length) == 0);
    REQUIRE(message_parse(message, length, &parsed) == STATUS_OK);
    REQUIRE(message_build(&parsed, buffer) == length && memcmp(buffer, message, length) == 0);
    REQUIRE(cobs_encode(message, length, buffer) == framed_length - 2);
    REQUIRE(memcmp(buffer, framed + 1, framed_length - 2) == 0);
}

int main(int argc, char **argv)
{
    static char name[80], message_hex[2 * PROTOCOL_MESSAGE_MAX + 2], framed_hex[2 * FRAMED_MAX + 2];
    uint8_t     message[PROTOCOL_MESSAGE_MAX], framed[FRAMED_MAX];
    unsigned    lines = 0;
    FILE       *file;

    REQUIRE(argc == 2 && (file = fopen(argv[1], "r")) != NULL);
    while (fscanf(file, "%79s %2105s %2119s", name, message_hex, framed_hex) == 3) {
        size_t length = from_hex(message_hex, message, sizeof(message));

        check(name, message, length, framed, from_hex(framed_hex, framed, sizeof(framed)));
        lines++;
    }
    REQUIRE(feof(file) && lines > 0);
    fclose(file);
    printf("%u vectors\n", lines);
    return 0;
}
