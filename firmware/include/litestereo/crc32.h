/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_CRC32_H
#define LITESTEREO_CRC32_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** CRC-32 (IEEE 802.3) of `length` bytes that follow bytes whose CRC is `crc`; 0 for the first.
 *
 * crc32_update(crc32_update(0, a, n), b, m) is the CRC of a followed by b, as with zlib's crc32().
 */
uint32_t crc32_update(uint32_t crc, const void *data, size_t length);

#ifdef __cplusplus
}
#endif

#endif
