/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "image.h"

#include <litestereo/crc32.h>
#include <litestereo/flash.h>

/* The header before the firmware. */
typedef struct {
    uint32_t length_bytes;
    uint32_t crc32;
} image_header_t;

_Static_assert(sizeof(image_header_t) == FLASH_HEADER_BYTES, "an update writes the same header");

uint32_t image_load(uint32_t address, void *memory, uint32_t room_bytes)
{
    image_header_t header;

    flash_read(address, &header, sizeof(header));
    if (header.length_bytes > room_bytes) {
        return 0;
    }
    flash_read(address + (uint32_t)sizeof(header), memory, header.length_bytes);
    return crc32_update(0, memory, header.length_bytes) == header.crc32 ? header.length_bytes : 0;
}
