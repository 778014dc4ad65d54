/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The SPI flash of bitstream and firmware, at pins that the CPU drives itself. Only the images of the firmware can be
 * written: what else is there brings the FPGA up. Erasing and programming take the flash a while: they are begun, and
 * their end is asked for. A SoC without a flash has these functions, too; flash_init says that there is none. */

#ifndef LITESTEREO_FLASH_H
#define LITESTEREO_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"

#define FLASH_SECTOR_BYTES 4096u
#define FLASH_PAGE_BYTES   256u

/** A flash; the members are for reading. */
typedef struct {
    uint32_t id;             /**< JEDEC's: manufacturer, kind, power of two of its bytes; a byte each. */
    uint32_t images;         /**< Images of the firmware that there is room for, */
    uint32_t images_offset;  /**< address of the first one in the flash, */
    uint32_t image_bytes;    /**< and bytes of each; one lies behind the other. */
    uint32_t clock_hz;       /**< Clocks in a second. */
    uint64_t began;          /**< Clock at which the operation under way began, */
    uint64_t limit;          /**< and clocks that it may take. */
} flash_t;

/** Finds the flash; STATUS_UNSUPPORTED if the SoC has none, none answers, or the images do not fit in it. */
status_t flash_init(flash_t *flash, uint32_t clock_hz);

/** Reads from a byte address of the flash, which must be at rest. */
void flash_read(uint32_t address, void *data, uint32_t length);

/** Begins to erase the sector at an address, a multiple of FLASH_SECTOR_BYTES: all its bits become ones.
 *
 * STATUS_BAD_ARGUMENT if it is not one of an image, STATUS_BUSY if the flash is not at rest, STATUS_PROTECTED if it does
 * not let itself be written.
 */
status_t flash_begin_erase(flash_t *flash, uint32_t address, uint64_t clock);

/** Begins to program bytes of one page, at most FLASH_PAGE_BYTES: their zeros become zeros there. Returns as
 * flash_begin_erase does. */
status_t flash_begin_program(flash_t *flash, uint32_t address, const uint8_t *data, uint32_t length, uint64_t clock);

/** STATUS_OK once the flash is at rest, STATUS_BUSY until then, STATUS_TIMEOUT if it takes longer than any flash does. */
status_t flash_poll(const flash_t *flash, uint64_t clock);

/** Whether a part of the flash, whichever, is protected from being written. */
bool flash_is_protected(const flash_t *flash);

#endif
