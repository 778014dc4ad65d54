/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/cobs.h"

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

static void begin_block(cobs_decoder_t *decoder, uint8_t code)
{
    if (decoder->zero_due) {
        if (decoder->length < decoder->capacity) {
            decoder->buffer[decoder->length++] = 0;
        } else {
            decoder->overflow = true;
        }
    }
    decoder->started   = true;
    decoder->remaining = code - 1;
    decoder->zero_due  = code != FULL_BLOCK;
}

/* Copies from `in` to `out` up to a zero or `end`; returns where it stopped. */
static const uint8_t *copy_block(uint8_t *out, const uint8_t *in, const uint8_t *end)
{
    while (in < end && *in != 0) {
        *out++ = *in++;
    }
    return in;
}

static const uint8_t *skip_block(const uint8_t *in, const uint8_t *end)
{
    while (in < end && *in != 0) {
        in++;
    }
    return in;
}

size_t cobs_decode(cobs_decoder_t *decoder, const uint8_t *bytes, size_t length)
{
    const uint8_t *in  = bytes;
    const uint8_t *end = bytes + length;

    while (in < end && *in != 0) {
        size_t         room = decoder->capacity - decoder->length;
        size_t         run  = decoder->remaining;
        const uint8_t *stop;

        if (run == 0) {
            begin_block(decoder, *in++);
            continue;
        }
        if (run > (size_t)(end - in)) {
            run = (size_t)(end - in);
        }
        if (run > room) {
            decoder->overflow = true;
            stop = skip_block(in, in + run);
        } else {
            stop = copy_block(decoder->buffer + decoder->length, in, in + run);
            decoder->length += (size_t)(stop - in);
        }
        decoder->remaining -= (uint8_t)(stop - in);
        in = stop;
    }
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
    const uint8_t *in   = bytes;
    const uint8_t *end  = bytes + length;
    uint8_t       *code = encoded;
    uint8_t       *out  = encoded + 1;

    for (;;) {
        const uint8_t *block = end - in > 254 ? in + 254 : end;
        size_t         run;

        while (in < block && *in != 0) {
            *out++ = *in++;
        }
        run   = (size_t)(out - code);
        *code = (uint8_t)run;
        if (in == end) {
            break;
        }
        if (run != FULL_BLOCK) {
            in++;
        }
        code = out++;
    }
    return (size_t)(out - encoded);
}
