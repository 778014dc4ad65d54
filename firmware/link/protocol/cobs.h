/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_LINK_PROTOCOL_COBS_H
#define LITESTEREO_LINK_PROTOCOL_COBS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "litestereo/status.h"

/** Bytes that the encoding of `length` bytes takes at most, without delimiters. */
#define COBS_ENCODED_MAX(length) ((length) + ((length) + 253) / 254 + ((length) == 0))

/** Decoder of an encoding that arrives in pieces of any size. */
typedef struct {
    uint8_t *buffer;     /**< Receives decoded bytes. */
    size_t   capacity;   /**< Bytes that `buffer` holds. */
    size_t   length;     /**< Bytes decoded so far, 0 to `capacity`. */
    uint8_t  remaining;  /**< Bytes remaining in the block, 0 to 254; 0 if a code byte comes next. */
    bool     zero_due;   /**< A zero precedes the next block, if there is one. */
    bool     started;    /**< A byte has been decoded since the reset. */
    bool     overflow;   /**< The buffer is too small; the rest is dropped. */
} cobs_decoder_t;

/** Gives the decoder its buffer and resets it. */
void cobs_decoder_init(cobs_decoder_t *decoder, uint8_t *buffer, size_t capacity);

/** Makes the decoder ready for the next frame. */
void cobs_decoder_reset(cobs_decoder_t *decoder);

/** Decodes bytes up to a delimiter (0x00) or the end; returns their number, without the delimiter. */
size_t cobs_decode(cobs_decoder_t *decoder, const uint8_t *bytes, size_t length);

/** Tells at a delimiter whether a complete frame was decoded: STATUS_OK or STATUS_FRAMING. */
status_t cobs_decoder_finish(const cobs_decoder_t *decoder);

/** Encodes `length` bytes into `encoded`, which has room for COBS_ENCODED_MAX(length); returns the bytes written.
 *
 * No delimiter is written. A full block of 254 bytes at the end is not followed by an empty one.
 */
size_t cobs_encode(const uint8_t *bytes, size_t length, uint8_t *encoded);

#endif
