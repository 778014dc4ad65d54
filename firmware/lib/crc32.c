/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/crc32.h"

#include <stdbool.h>

#define POLYNOMIAL 0xedb88320u

typedef uint32_t __attribute__((may_alias)) word_t;

/* One table of 1 KiB: more tables need fewer steps per byte, but do not fit in a small data cache. */
static uint32_t table[256];
static bool     table_ready;

static void build_table(void)
{
    for (uint32_t byte = 0; byte < 256; byte++) {
        uint32_t crc = byte;

        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ ((crc & 1) ? POLYNOMIAL : 0);
        }
        table[byte] = crc;
    }
    table_ready = true;
}

/* Advances the CRC by the eight bits that have been added to it. */
static uint32_t step(uint32_t crc)
{
    return (crc >> 8) ^ table[crc & 0xff];
}

uint32_t crc32_update(uint32_t crc, const void *data, size_t length)
{
    const uint8_t *bytes = data;

    if (!table_ready) {
        build_table();
    }
    crc = ~crc;
    for (; length > 0 && ((uintptr_t)bytes & 3) != 0; length--) {
        crc = step(crc ^ *bytes++);
    }
    for (; length >= 4; length -= 4, bytes += 4) {
        crc = step(step(step(step(crc ^ *(const word_t *)bytes))));
    }
    for (; length > 0; length--) {
        crc = step(crc ^ *bytes++);
    }
    return ~crc;
}
