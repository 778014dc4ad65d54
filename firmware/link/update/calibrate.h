/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The calibration of a device: loaded to memory, checked, used, and kept in flash.
 *
 *   EMPTY -> LOADING -> CHECKING -> WRITING -> DONE
 *                          |   \       |       ^
 *                          |    +------|-------+   (not kept)
 *                          +-----------+-----> FAILED
 *
 * The calibration in use stays as it is until the check of another one has ended well. */

#ifndef LITESTEREO_LINK_UPDATE_CALIBRATE_H
#define LITESTEREO_LINK_UPDATE_CALIBRATE_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/records.h"
#include "litestereo/rectification.h"
#include "litestereo/status.h"

/** Bytes of memory for the calibration in use and the one that is loaded. */
#define CALIBRATE_MEMORY_BYTES (2u * CALIBRATE_ROOM)

/** Most bytes of a calibration. */
#define CALIBRATE_ROOM RECORD_MOST_BYTES

/** States of an announced calibration, as the link protocol numbers them. */
typedef enum {
    CALIBRATE_EMPTY    = 0,  /**< There is none. */
    CALIBRATE_LOADING  = 1,  /**< It is being received. */
    CALIBRATE_CHECKING = 2,  /**< It is being checked. */
    CALIBRATE_WRITING  = 3,  /**< It is in use, and is being written to flash. */
    CALIBRATE_DONE     = 4,  /**< It is in use. */
    CALIBRATE_FAILED   = 5,  /**< It was given up. */
} calibrate_state_t;

/** Why a calibration has failed, as the link protocol numbers it. */
typedef enum {
    CALIBRATE_NO_FAILURE = 0,
    CALIBRATE_CHECKSUM   = 1,  /**< The checksum is not the announced one. */
    CALIBRATE_FORMAT     = 2,  /**< It is no calibration of this version, or has a wrong length. */
    CALIBRATE_SIZE       = 3,  /**< Gateware cannot rectify frames of this size. */
    CALIBRATE_FOLDED     = 4,  /**< Its map folds over. */
    CALIBRATE_ROWS       = 5,  /**< It needs more rows than gateware keeps. */
    CALIBRATE_FLASH      = 6,  /**< It was not written to flash; it is in use until the next reset. */
} calibrate_failure_t;

/** The calibration of a device. */
typedef struct {
    rectification_t    *rectification;  /**< What uses it. */
    records_t          *records;        /**< Where it is kept; null if there is no place. */
    uint8_t            *memory[2];      /**< Records: of the calibration in use, and of the announced one. */
    unsigned            announced;      /**< Which of them is that of the announced one. */
    calibrate_state_t   state;          /**< Changed by the functions below only. */
    calibrate_failure_t failure;        /**< Reason if the state is FAILED. */
    uint32_t            length;         /**< Announced bytes. */
    uint32_t            crc32;          /**< Announced checksum: of all but the last four bytes, which are it. */
    bool                keep;           /**< It is to be kept in flash. */
    bool                writing;        /**< Its record has been handed to the flash. */
    bool                kept;           /**< The calibration in use is in flash. */
} calibrate_t;

/** Prepares the calibration of a device, with CALIBRATE_MEMORY_BYTES of memory; `records` may be null. */
void calibrate_init(calibrate_t *calibrate, rectification_t *rectification, records_t *records, uint8_t *memory);

/** Uses the calibration that is in flash: STATUS_NO_RECORD if there is none, or what rectification_use returns. */
status_t calibrate_recall(calibrate_t *calibrate);

/** Whether a calibration is being checked or written. */
bool calibrate_is_running(const calibrate_t *calibrate);

/** Announces a calibration. Announcing the same one again changes nothing, unless the state is FAILED.
 * STATUS_SIZE if there is no room for it, STATUS_STATE if another one is being checked or written. */
status_t calibrate_begin(calibrate_t *calibrate, uint32_t length, uint32_t crc32);

/** Bytes of the chunk that begins at an offset; 0 if none does. */
uint32_t calibrate_chunk_length(const calibrate_t *calibrate, uint32_t offset);

/** Stores a chunk of the calibration that is LOADING: STATUS_STATE, STATUS_OFFSET or STATUS_LENGTH if it does not fit. */
status_t calibrate_store(calibrate_t *calibrate, uint32_t offset, const uint8_t *chunk, uint32_t length);

/** Begins to check and use the calibration, and to keep it; repeating it is no error. STATUS_STATE if none has been
 * announced, STATUS_UNSUPPORTED if it cannot be kept. */
status_t calibrate_adopt(calibrate_t *calibrate, bool keep);

/** Uses no calibration, and erases the one in flash; waits for that. STATUS_STATE while one is checked or written,
 * STATUS_BUSY while another record is written: then nothing changes. */
status_t calibrate_forget(calibrate_t *calibrate);

/** Discards the announced calibration, unless it is being checked or written. */
void calibrate_discard(calibrate_t *calibrate);

/** Does the next piece of work, about a millisecond. To be called often; not while the flash is used otherwise. */
void calibrate_poll(calibrate_t *calibrate, uint64_t clock);

#endif
