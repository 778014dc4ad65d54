/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Records in flash: what a program must know after a power failure, such as a calibration.
 *
 * There is one record of each kind, in two copies, each with a checksum and a sequence number. A write replaces the
 * older copy, and programs its header last. So the power may fail at any moment: a read then returns the old record or
 * the new one, whole. An erase removes the older copy first, so it never brings back a record that was replaced before.
 * A record that already has the wanted bytes is not written again, because a sector of a flash lasts for about 100000
 * erases only. */

#ifndef LITESTEREO_RECORDS_H
#define LITESTEREO_RECORDS_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/flash.h"
#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Kinds of records. Our firmware uses 0 to 3; the others, below RECORD_KINDS, are a program's own. */
enum { RECORD_TRIAL = 0, RECORD_CALIBRATION = 1, RECORD_NETWORK = 2, RECORD_PROGRAM = 4, RECORD_KINDS = 8 };

/** Bytes of flash for each copy: whole sectors. */
#define RECORD_COPY_BYTES (5 * FLASH_SECTOR_BYTES)

/** Most bytes of a record: the first page of a copy is its header's. */
#define RECORD_MOST_BYTES (RECORD_COPY_BYTES - FLASH_PAGE_BYTES)

/** Steps of a write. */
typedef enum { RECORDS_IDLE, RECORDS_SURVEY, RECORDS_ERASE, RECORDS_PROGRAM, RECORDS_HEADER, RECORDS_CHECK } records_step_t;

/** The records of a flash; read-only for the caller. */
typedef struct {
    flash_t       *flash;     /**< The flash; null if it has no place for records. */
    records_step_t step;      /**< Step of the current write. */
    bool           erasing;   /**< The current write erases the record. */
    uint32_t       kind;      /**< Kind of the record. */
    const uint8_t *data;      /**< Its new bytes. */
    uint32_t       size;      /**< Number of these. */
    uint32_t       sequence;  /**< Its new sequence number. */
    uint32_t       newest;    /**< Address of the copy that is valid now; 0 if none is. */
    uint32_t       target;    /**< Address of the copy being written. */
    uint32_t       position;  /**< Bytes of it that this step has finished. */
} records_t;

/** Prepares the records of a flash that flash_init has identified; STATUS_UNSUPPORTED if it has no place for them. */
status_t records_init(records_t *records, flash_t *flash);

/** Reads the record of a kind to a buffer of `room` bytes; writes its size in bytes to `size`.
 *
 * STATUS_NO_RECORD if there is none, or both copies are damaged; STATUS_LENGTH if it has more than `room` bytes;
 * STATUS_BUSY while the flash is written; STATUS_BAD_ARGUMENT if there is no such kind; STATUS_UNSUPPORTED without a
 * place for records. Reading takes about 1 ms per 256 bytes.
 */
status_t records_read(const records_t *records, uint32_t kind, void *buffer, uint32_t room, uint32_t *size);

/** Writes the record of a kind, and waits until it is in flash, which typically takes 50 ms per sector; feeds the
 * watchdog meanwhile.
 *
 * STATUS_LENGTH if it has more than RECORD_MOST_BYTES; STATUS_PROTECTED if the flash is write-protected; STATUS_TIMEOUT
 * if it stays busy; STATUS_CRC if it does not hold what was written. In these cases the old record remains. Otherwise
 * as records_read.
 */
status_t records_write(records_t *records, uint32_t kind, const void *data, uint32_t size);

/** Erases the record of a kind, and waits for it; no error if there is none. Returns what records_write does. */
status_t records_erase(records_t *records, uint32_t kind);

/** Begins to write a record without waiting: call records_poll until it has ended, and leave `data` as it is. Returns
 * what records_write does before the flash is written; STATUS_BUSY if another write has not ended. */
status_t records_begin_write(records_t *records, uint32_t kind, const void *data, uint32_t size);

/** Does the next piece of a write, a page or less than a millisecond; its first and last piece read both copies.
 * STATUS_BUSY until it has ended, then once what records_write returns; STATUS_IDLE if nothing is written. */
status_t records_poll(records_t *records, uint64_t clock);

#ifdef __cplusplus
}
#endif

#endif
