/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Answers each line of the input by a line, bytes in hexadecimal:
 *
 *   encode BYTES   their COBS encoding
 *   decode BYTES   the bytes of which they are the COBS encoding
 *   parse BYTES    version, type, session, sequence, frame id, offset and payload of the message
 *
 * The answer to anything else is "refused". A line ends with a dot, so that BYTES may be empty. */

#include <string.h>

#include "link/protocol/cobs.h"
#include "link/protocol/message.h"
#include "require.h"

#define MOST 4096u

static void print_hex(const uint8_t *bytes, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        printf("%02x", bytes[i]);
    }
    printf(".\n");
}

static size_t from_hex(const char *text, uint8_t *bytes)
{
    size_t length = strlen(text) / 2;

    REQUIRE(strlen(text) % 2 == 1 && text[2 * length] == '.' && length <= MOST);
    for (size_t i = 0; i < length; i++) {
        unsigned value;

        REQUIRE(sscanf(text + 2 * i, "%2x", &value) == 1);
        bytes[i] = (uint8_t)value;
    }
    return length;
}

static void encode(const uint8_t *bytes, size_t length)
{
    static uint8_t encoded[COBS_ENCODED_MAX(MOST)];

    print_hex(encoded, cobs_encode(bytes, length, encoded));
}

static void decode(const uint8_t *bytes, size_t length)
{
    static uint8_t decoded[MOST];
    cobs_decoder_t decoder;

    cobs_decoder_init(&decoder, decoded, sizeof(decoded));
    if (cobs_decode(&decoder, bytes, length) != length || cobs_decoder_finish(&decoder) != STATUS_OK) {
        printf("refused\n");
    } else {
        print_hex(decoded, decoder.length);
    }
}

static void parse(const uint8_t *bytes, size_t length)
{
    message_t message;

    if (message_parse(bytes, length, &message) != STATUS_OK) {
        printf("refused\n");
    } else {
        printf("%u %u %u %u %u %u ", message.version, message.type, (unsigned)message.session,
            (unsigned)message.sequence, (unsigned)message.frame_id, (unsigned)message.offset);
        print_hex(message.payload, message.length);
    }
}

int main(void)
{
    static char    what[8], text[2 * MOST + 2];
    static uint8_t bytes[MOST];

    while (scanf("%7s %8193s", what, text) == 2) {
        size_t length = from_hex(text, bytes);

        if (strcmp(what, "encode") == 0) {
            encode(bytes, length);
        } else if (strcmp(what, "decode") == 0) {
            decode(bytes, length);
        } else {
            REQUIRE(strcmp(what, "parse") == 0);
            parse(bytes, length);
        }
        fflush(stdout);
    }
    return 0;
}
