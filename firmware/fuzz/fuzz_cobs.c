/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* COBS: any bytes are decoded in pieces, and by the definition; and any bytes are
 * encoded and decoded again.
 *
 * The first byte of the input is the size of the pieces, the second says how much room the decoder has. */

#include <stdbool.h>
#include <string.h>

#include "fuzz.h"
#include "link/protocol/cobs.h"

/* Decodes by the definition; returns the length, or SIZE_MAX if it is not an encoding or does not fit. */
static size_t decode_by_definition(const uint8_t *encoded, size_t length, uint8_t *decoded, size_t capacity)
{
    size_t out = 0;

    if (length == 0) {
        return SIZE_MAX;
    }
    for (size_t at = 0; at < length;) {
        size_t code = encoded[at];

        if (at + code > length || out + code - 1 > capacity) {
            return SIZE_MAX;
        }
        memcpy(decoded + out, encoded + at + 1, code - 1);
        out += code - 1;
        at  += code;
        if (code != 255 && at < length) {
            if (out == capacity) {
                return SIZE_MAX;
            }
            decoded[out++] = 0;
        }
    }
    return out;
}

static void init(cobs_decoder_t *decoder, uint8_t *buffer, size_t capacity)
{
#ifdef PLANTED_FAULT
    capacity++;
#endif
    cobs_decoder_init(decoder, buffer, capacity);
}

/* Decodes bytes up to a delimiter, or the end; returns how many there are. */
static size_t check_decoder(cobs_decoder_t *decoder, const uint8_t *bytes, size_t length, size_t piece)
{
    const uint8_t *zero    = memchr(bytes, 0, length);
    size_t         whole   = zero != NULL ? (size_t)(zero - bytes) : length;
    uint8_t       *plain   = malloc(decoder->capacity);
    size_t         wanted  = decode_by_definition(bytes, whole, plain, decoder->capacity);

    cobs_decoder_reset(decoder);
    for (size_t at = 0; at < whole;) {
        size_t step = length - at < piece ? length - at : piece;
        size_t took = cobs_decode(decoder, bytes + at, step);

        HOLDS(took == (step < whole - at ? step : whole - at));
        at += took;
    }
    HOLDS(decoder->length <= decoder->capacity && decoder->started == (whole > 0));
    HOLDS((cobs_decoder_finish(decoder) == STATUS_OK) == (wanted != SIZE_MAX));
    if (wanted != SIZE_MAX) {
        HOLDS(decoder->length == wanted && memcmp(decoder->buffer, plain, wanted) == 0);
    }
    free(plain);
    return whole;
}

static void check_encoder(const uint8_t *bytes, size_t length)
{
    size_t   most    = COBS_ENCODED_MAX(length);
    uint8_t *encoded = malloc(most);
    uint8_t *decoded = malloc(length);
    size_t   size    = cobs_encode(bytes, length, encoded);

    HOLDS(size <= most && memchr(encoded, 0, size) == NULL);
    HOLDS(decode_by_definition(encoded, size, decoded, length) == length && memcmp(decoded, bytes, length) == 0);
    free(decoded);
    free(encoded);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t        input    = {data, size};
    size_t         piece    = 1u + take(&input);
    size_t         capacity = 4u * take(&input);
    uint8_t       *buffer   = malloc(capacity);
    cobs_decoder_t decoder;

    check_encoder(input.bytes, input.length);
    init(&decoder, buffer, capacity);
    while (input.length > 0) {
        size_t taken = check_decoder(&decoder, input.bytes, input.length, piece);

        taken        += taken < input.length;
        input.bytes  += taken;
        input.length -= taken;
    }
    free(buffer);
    return 0;
}
