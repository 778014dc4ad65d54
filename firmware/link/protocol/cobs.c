/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "cobs.h"

#define FULL_BLOCK 0xff  /* Code of 254 bytes that no zero follows. */

void cobs_decoder_init(cobs_decoder_t *decoder, uint8_t *buffer, size_t capacity)
{
    decoder->buffer   = buffer;
    decoder->capacity = capacity;
    cobs_decoder_reset(decoder);
}

void cobs_decoder_reset(cobs_decoder_t *decoder)
{
    decoder->length    = 0;
    decoder->remaining = 0;
    decoder->zero_due  = false;
    decoder->started   = false;
    decoder->overflow  = false;
}

/* Copies a block's bytes from `in` up to a zero or `end`, or skips them if they do not fit; returns where it
 * stopped. */
static const uint8_t *copy_block(uint8_t *out, const uint8_t *in, const uint8_t *end, bool fits)
{
    if (fits) {
        while (in < end && *in != 0) {
            *out++ = *in++;
        }
    } else {
        while (in < end && *in != 0) {
            in++;
        }
    }
    return in;
}

size_t cobs_decode(cobs_decoder_t *decoder, const uint8_t *bytes, size_t length)
{
    /* The state is kept in registers, because every byte of every frame is decoded here. */
    const uint8_t *in        = bytes;
    const uint8_t *end       = bytes + length;
    uint8_t       *out       = decoder->buffer + decoder->length;
    uint8_t       *limit     = decoder->buffer + decoder->capacity;
    size_t         remaining = decoder->remaining;
    bool           zero_due  = decoder->zero_due;

    while (in < end && *in != 0) {
        decoder->started = true;
        if (remaining == 0) {
            if (zero_due && out < limit) {
                *out++ = 0;
            } else if (zero_due) {
                decoder->overflow = true;
            }
            remaining = *in - 1u;
            zero_due  = *in != FULL_BLOCK;
            in++;
        } else {
            size_t         count = remaining < (size_t)(end - in) ? remaining : (size_t)(end - in);
            bool           fits  = count <= (size_t)(limit - out);
            const uint8_t *stop  = copy_block(out, in, in + count, fits);

            if (fits) {
                out += stop - in;
            } else {
                decoder->overflow = true;
            }
            remaining -= (size_t)(stop - in);
            in = stop;
        }
    }
    decoder->length    = (size_t)(out - decoder->buffer);
    decoder->remaining = (uint8_t)remaining;
    decoder->zero_due  = zero_due;
    return (size_t)(in - bytes);
}

status_t cobs_decoder_finish(const cobs_decoder_t *decoder)
{
    if (!decoder->started || decoder->remaining != 0 || decoder->overflow) {
        return STATUS_FRAMING;
    }
    return STATUS_OK;
}

size_t cobs_encode(const uint8_t *bytes, size_t length, uint8_t *encoded)
{
    const uint8_t *end  = bytes + length;
    uint8_t       *code = encoded;
    uint8_t       *out  = encoded + 1;

    while (bytes < end) {
        uint8_t byte = *bytes++;

        *out++ = byte;
        if (byte == 0) {
            /* The code of the next block takes the place of the zero. */
            *code = (uint8_t)(out - 1 - code);
            code  = out - 1;
        } else if (out - code == FULL_BLOCK && bytes < end) {
            *code = FULL_BLOCK;
            code  = out++;
        }
    }
    *code = (uint8_t)(out - code);
    return (size_t)(out - encoded);
}
