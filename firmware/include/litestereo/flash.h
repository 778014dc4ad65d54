/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The SPI flash with bitstream and firmware, whose pins the CPU drives by software. Two regions can be written: the
 * images of the firmware, and its records (see records.h). All else cannot, because the FPGA loads it. Erasing and programming take time: begin them, then poll for their end.
 * In a SoC without a flash all functions that return a status return STATUS_UNSUPPORTED. */

#ifndef LITESTEREO_FLASH_H
#define LITESTEREO_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FLASH_SECTOR_BYTES 4096u
#define FLASH_PAGE_BYTES   256u

/** Bytes of an image before the firmware: length and CRC-32, two little-endian words, as in LiteX's BIOS. */
#define FLASH_HEADER_BYTES 8u

/** A flash; read-only for the caller. */
typedef struct {
    uint32_t id;             /**< JEDEC id, a byte each: manufacturer, type, log2 of the capacity in bytes. */
    uint32_t images;         /**< Number of images of the firmware that it has room for. */
    uint32_t images_offset;  /**< Address of the first image; the others follow without gaps. */
    uint32_t image_bytes;    /**< Bytes of each image. */
    uint32_t records_offset; /**< Address of the records. */
    uint32_t records_bytes;  /**< Bytes of the records; 0 if the SoC has no place for them. */
    uint32_t clock_hz;       /**< Clocks per second. */
    uint64_t began;          /**< Clock at which the current operation began. */
    uint64_t limit;          /**< Clocks that the operation may take. */
} flash_t;

/** Identifies the flash; STATUS_UNSUPPORTED if the SoC has none, it does not answer, or it is too small for
 * images and records. */
status_t flash_init(flash_t *flash, uint32_t clock_hz);

/** Reads from a byte address of the flash, which must not be busy. */
void flash_read(uint32_t address, void *data, uint32_t length);

/** Whether the flash is busy with an operation, perhaps one from before a reset; also if it does not answer. */
bool flash_is_busy(void);

/** Begins to erase the sector at an address, a multiple of FLASH_SECTOR_BYTES: all its bits become ones.
 *
 * STATUS_BAD_ARGUMENT if it is not a sector of an image or of the records, STATUS_BUSY if the flash is busy, STATUS_PROTECTED if it is
 * write-protected.
 */
status_t flash_begin_erase(flash_t *flash, uint32_t address, uint64_t clock);

/** Begins to program bytes within one page, at most FLASH_PAGE_BYTES. Programming only clears bits: erase before.
 * Returns what flash_begin_erase does. */
status_t flash_begin_program(flash_t *flash, uint32_t address, const uint8_t *data, uint32_t length, uint64_t clock);

/** STATUS_OK once the flash is ready, STATUS_BUSY until then, STATUS_TIMEOUT if the operation takes too long. */
status_t flash_poll(const flash_t *flash, uint64_t clock);

/** Whether any part of the flash is write-protected. */
bool flash_is_protected(const flash_t *flash);

#ifdef __cplusplus
}
#endif

#endif
