/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/crc32.h"

#include <stdbool.h>

#define POLYNOMIAL 0xedb88320u

typedef uint32_t __attribute__((may_alias)) word_t;

/* table[0] advances the CRC by one byte, table[n] by n zero bytes more, so that a word takes four look-ups
 * that do not wait for each other. */
static uint32_t table[4][256];
static bool     table_ready;

static void build_table(void)
{
    for (uint32_t byte = 0; byte < 256; byte++) {
        uint32_t crc = byte;

        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ ((crc & 1) ? POLYNOMIAL : 0);
        }
        table[0][byte] = crc;
    }
    for (uint32_t byte = 0; byte < 256; byte++) {
        for (int n = 1; n < 4; n++) {
            uint32_t crc = table[n - 1][byte];

            table[n][byte] = (crc >> 8) ^ table[0][crc & 0xff];
        }
    }
    table_ready = true;
}

static uint32_t add_byte(uint32_t crc, uint8_t byte)
{
    return (crc >> 8) ^ table[0][(crc ^ byte) & 0xff];
}

uint32_t crc32_update(uint32_t crc, const void *data, size_t length)
{
    const uint8_t *bytes = data;

    if (!table_ready) {
        build_table();
    }
    crc = ~crc;
    for (; length > 0 && ((uintptr_t)bytes & 3) != 0; length--) {
        crc = add_byte(crc, *bytes++);
    }
    for (; length >= 4; length -= 4, bytes += 4) {
        crc ^= *(const word_t *)bytes;
        crc = table[3][crc & 0xff] ^ table[2][(crc >> 8) & 0xff]
            ^ table[1][(crc >> 16) & 0xff] ^ table[0][crc >> 24];
    }
    for (; length > 0; length--) {
        crc = add_byte(crc, *bytes++);
    }
    return ~crc;
}
