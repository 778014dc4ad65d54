/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdint.h>
#include <string.h>

#include "link/protocol/cobs.h"
#include "require.h"

#define MOST 1100

static uint8_t data[MOST], encoded[COBS_ENCODED_MAX(MOST)], decoded[MOST];

static status_t decode_in_pieces(const uint8_t *bytes, size_t length, size_t piece, size_t capacity, size_t *result)
{
    cobs_decoder_t decoder;

    cobs_decoder_init(&decoder, decoded, capacity);
    for (size_t i = 0; i < length; i += piece) {
        size_t n = length - i < piece ? length - i : piece;

        REQUIRE(cobs_decode(&decoder, bytes + i, n) == n);
    }
    *result = decoder.length;
    return cobs_decoder_finish(&decoder);
}

static void check_round_trip(size_t length)
{
    static const size_t pieces[] = {1, 2, 7, 255, MOST};
    size_t n = cobs_encode(data, length, encoded);
    size_t got;

    REQUIRE(n <= COBS_ENCODED_MAX(length));
    REQUIRE(memchr(encoded, 0, n) == NULL);
    for (size_t i = 0; i < sizeof(pieces) / sizeof(pieces[0]); i++) {
        REQUIRE(decode_in_pieces(encoded, n, pieces[i], length, &got) == STATUS_OK);
        REQUIRE(got == length && memcmp(decoded, data, length) == 0);
        if (length > 0) {
            REQUIRE(decode_in_pieces(encoded, n, pieces[i], length - 1, &got) == STATUS_FRAMING);
            REQUIRE(got <= length - 1);
        }
    }
    /* Every truncated encoding is detected, or encodes less than the data. */
    for (size_t cut = 0; cut < n; cut++) {
        status_t status = decode_in_pieces(encoded, cut, MOST, MOST, &got);

        REQUIRE(status == STATUS_FRAMING || got < length);
    }
}

/* Lengths at the edges of blocks, for data without zeros, of zeros only, and with a zero at each edge. */
static void test_edges(void)
{
    static const size_t lengths[] = {0, 1, 2, 253, 254, 255, 256, 507, 508, 509, 510, 1023, 1024, 1052};

    for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
        size_t length = lengths[i];

        for (size_t j = 0; j < MOST; j++) {
            data[j] = (uint8_t)(1 + j % 255);
        }
        check_round_trip(length);
        for (size_t zero = 0; zero < length; zero += zero < 3 || zero + 4 > length ? 1 : 63) {
            data[zero] = 0;
            check_round_trip(length);
        }
        memset(data, 0, sizeof(data));
        check_round_trip(length);
    }
}

static void test_known_encodings(void)
{
    uint8_t block[255];
    size_t  got;

    REQUIRE(cobs_encode(data, 0, encoded) == 1 && encoded[0] == 1);
    REQUIRE(cobs_encode((const uint8_t[]){9, 0, 0, 8}, 4, encoded) == 5);
    REQUIRE(memcmp(encoded, (const uint8_t[]){2, 9, 1, 2, 8}, 5) == 0);
    memset(block, 7, sizeof(block));
    REQUIRE(cobs_encode(block, 254, encoded) == 255 && encoded[0] == 255 && encoded[254] == 7);
    REQUIRE(cobs_encode(block, 255, encoded) == 257 && encoded[255] == 2);
    block[254] = 0;
    REQUIRE(cobs_encode(block, 255, encoded) == 257 && encoded[255] == 1 && encoded[256] == 1);
    /* Other encoders write an empty block after a full one at the end; it encodes nothing. */
    REQUIRE(cobs_encode(block, 254, encoded) == 255);
    encoded[255] = 1;
    REQUIRE(decode_in_pieces(encoded, 256, 1, MOST, &got) == STATUS_OK && got == 254);
}

static void test_delimiter_stops(void)
{
    static const uint8_t bytes[] = {3, 5, 6, 0, 2, 7, 0, 4, 1, 0};
    cobs_decoder_t       decoder;

    cobs_decoder_init(&decoder, decoded, sizeof(decoded));
    REQUIRE(cobs_decode(&decoder, bytes, sizeof(bytes)) == 3);
    REQUIRE(cobs_decoder_finish(&decoder) == STATUS_OK && decoder.length == 2);
    REQUIRE(cobs_decode(&decoder, bytes + 3, 1) == 0);
    cobs_decoder_reset(&decoder);
    REQUIRE(cobs_decoder_finish(&decoder) == STATUS_FRAMING);
    REQUIRE(cobs_decode(&decoder, bytes + 4, 6) == 2 && decoder.length == 1 && decoded[0] == 7);
    cobs_decoder_reset(&decoder);
    REQUIRE(cobs_decode(&decoder, bytes + 7, 3) == 2);
    REQUIRE(cobs_decoder_finish(&decoder) == STATUS_FRAMING);
}

static void test_garbage(void)
{
    unsigned random = 1;

    for (int round = 0; round < 2000; round++) {
        size_t length = next_random(&random) % MOST;
        size_t got;

        for (size_t i = 0; i < length; i++) {
            data[i] = (uint8_t)(1 + next_random(&random) % 255);
        }
        decode_in_pieces(data, length, 1 + next_random(&random) % 300, next_random(&random) % MOST, &got);
        REQUIRE(got <= MOST);
    }
}

int main(void)
{
    test_edges();
    test_known_encodings();
    test_delimiter_stops();
    test_garbage();
    return 0;
}
