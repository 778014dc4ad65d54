/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_LIB_PATTERN_H
#define LITESTEREO_LIB_PATTERN_H

#include <stdint.h>

/** One step of xorshift32: x ^= x << 13, x ^= x >> 17, x ^= x << 5, modulo 2**32; `x` is not 0. */
static inline uint32_t pattern_next(uint32_t x)
{
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return x;
}

/** Fills an image of `pixels` pixels, rounded up to whole words, with little-endian words.
 *
 * The first word is pattern_next(seed), each word after it pattern_next of the one before.
 */
static inline void pattern_fill(void *image, uint32_t pixels, uint32_t seed)
{
    uint32_t __attribute__((may_alias)) *word = image;
    uint32_t __attribute__((may_alias)) *end  = word + (pixels + 3) / 4;

    while (word < end) {
        seed    = pattern_next(seed);
        *word++ = seed;
    }
}

#endif
