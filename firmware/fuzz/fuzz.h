/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Shared by the fuzz targets: an input that is consumed piece by piece, and conditions that must hold. */

#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/** Ends the program as a crash, with the place and the text of a condition that does not hold. */
#define HOLDS(condition)                                                                \
    do {                                                                                \
        if (!(condition)) {                                                             \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
            abort();                                                                    \
        }                                                                               \
    } while (0)

/** The rest of an input. */
typedef struct {
    const uint8_t *bytes;
    size_t         length;
} input_t;

/** The next byte; 0 after the end. */
static inline uint8_t take(input_t *input)
{
    if (input->length == 0) {
        return 0;
    }
    input->length--;
    return *input->bytes++;
}

/** The next four bytes as a number. */
static inline uint32_t take_u32(input_t *input)
{
    uint32_t value = 0;

    for (unsigned i = 0; i < 4; i++) {
        value = value << 8 | take(input);
    }
    return value;
}

/** Called by libFuzzer with an input. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
