/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The two copies of a record in flash, as the boot program reads them as well. */

#ifndef LITESTEREO_DRIVERS_RECORD_COPY_H
#define LITESTEREO_DRIVERS_RECORD_COPY_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/records.h"

#define RECORD_MAGIC 0x4352534cu

/* Bytes before the data in a copy. */
#define RECORD_DATA_OFFSET FLASH_PAGE_BYTES

/* The header of a copy, at its beginning; little-endian. */
typedef struct {
    uint32_t magic;     /* RECORD_MAGIC: the bytes LSRC. */
    uint32_t kind;      /* Kind of the record. */
    uint32_t sequence;  /* One more than that of the record before; modulo 2**32. */
    uint32_t size;      /* Bytes of data. */
    uint32_t crc32;     /* Checksum of the words above, and of the data. */
} record_header_t;

/* Checksum of the first words of a header. */
uint32_t record_header_crc(const record_header_t *header);

/* Reads the header of a copy at an address; returns whether the copy is a whole record of this kind. */
bool record_copy_check(uint32_t address, uint32_t kind, record_header_t *header);

/* Finds the newest copy of a record, whose first copy is at an address: returns the address of that copy, and writes
 * its header; 0 if both are damaged. The flash must not be busy. */
uint32_t record_newest(uint32_t address, uint32_t kind, record_header_t *header);

#endif
