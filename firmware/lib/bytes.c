/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "bytes.h"

/* A word that may alias any type, so that the compiler keeps the order of accesses. */
typedef uint32_t __attribute__((may_alias)) word_t;

void copy_bytes(void *to, const void *from, size_t length)
{
    uint8_t       *out = to;
    const uint8_t *in  = from;

    if ((((uintptr_t)out | (uintptr_t)in) & 3) == 0) {
        for (; length >= 16; length -= 16, out += 16, in += 16) {
            uint32_t a = ((const word_t *)in)[0];
            uint32_t b = ((const word_t *)in)[1];
            uint32_t c = ((const word_t *)in)[2];
            uint32_t d = ((const word_t *)in)[3];

            ((word_t *)out)[0] = a;
            ((word_t *)out)[1] = b;
            ((word_t *)out)[2] = c;
            ((word_t *)out)[3] = d;
        }
    }
    while (length-- > 0) {
        *out++ = *in++;
    }
}
