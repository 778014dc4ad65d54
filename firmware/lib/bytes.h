/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_LIB_BYTES_H
#define LITESTEREO_LIB_BYTES_H

#include <stddef.h>
#include <stdint.h>

/** Reads a little-endian 16-bit number at any alignment. */
static inline uint16_t get_u16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | (bytes[1] << 8));
}

/** Reads a little-endian 32-bit number at any alignment. */
static inline uint32_t get_u32(const uint8_t *bytes)
{
    return get_u16(bytes) | ((uint32_t)get_u16(bytes + 2) << 16);
}

/** Writes a little-endian 16-bit number at any alignment. */
static inline void put_u16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)(value >> 8);
}

/** Writes a little-endian 32-bit number at any alignment. */
static inline void put_u32(uint8_t *bytes, uint32_t value)
{
    put_u16(bytes, (uint16_t)value);
    put_u16(bytes + 2, (uint16_t)(value >> 16));
}

/** Copies `length` bytes between areas that do not overlap, by words where both are aligned.
 *
 * The C library of a LiteX SoC is built for size and copies byte by byte, which costs more than receiving them.
 */
void copy_bytes(void *to, const void *from, size_t length);

#endif
