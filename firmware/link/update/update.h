/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* An update: a new firmware is loaded to memory, is checked there, and is written to an image in flash, for a trial.
 *
 *   EMPTY -> LOADING -> CHECKING -> WRITING -> DONE
 *                          |           |
 *                          +-----------+-----> FAILED
 *
 * The image that the boot program starts now is kept, so there is a good one at every moment, even if the power fails.
 * First the record of the trial says so, then the other image is written and read back, then the record says that this
 * one is on trial. Of the image the header's sector is erased first and the header's page is programmed last, so that an
 * incomplete image has no header. */

#ifndef LITESTEREO_LINK_UPDATE_UPDATE_H
#define LITESTEREO_LINK_UPDATE_UPDATE_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/flash.h"
#include "litestereo/status.h"
#include "litestereo/trial.h"

/** States of an update, as the link protocol numbers them. */
typedef enum {
    UPDATE_EMPTY    = 0,  /**< There is no firmware. */
    UPDATE_LOADING  = 1,  /**< The firmware is being received. */
    UPDATE_CHECKING = 2,  /**< The firmware in memory is being checked; the flash is untouched. */
    UPDATE_WRITING  = 3,  /**< An image is being replaced. */
    UPDATE_DONE     = 4,  /**< The image is the new firmware, which the next start tries. */
    UPDATE_FAILED   = 5,  /**< The update was given up; at least one image is good. */
} update_state_t;

/** Why an update has failed, as the link protocol numbers it. */
typedef enum {
    UPDATE_NO_FAILURE = 0,
    UPDATE_CHECKSUM   = 1,  /**< The checksum is not the announced one. */
    UPDATE_FOREIGN    = 2,  /**< It is not a firmware for this SoC. */
    UPDATE_PROTECTED  = 3,  /**< The flash is write-protected. */
    UPDATE_TIMEOUT    = 4,  /**< The flash stayed busy. */
    UPDATE_VERIFY     = 5,  /**< The flash does not hold what was written. */
} update_failure_t;

/** Steps of writing. */
typedef enum {
    UPDATE_SURVEY, UPDATE_KEEP, UPDATE_ERASE, UPDATE_PROGRAM, UPDATE_READ_BACK, UPDATE_RECORD
} update_step_t;

/** The update of a device. */
typedef struct {
    flash_t         *flash;             /**< The flash to write to. */
    trial_t         *trial;             /**< The trial of what is written. */
    uint8_t         *image;             /**< The image in memory, as it will be in flash. */
    update_state_t   state;             /**< Changed by the functions below only. */
    update_failure_t failure;           /**< Reason if the state is FAILED. */
    uint32_t         length;            /**< Announced bytes of the firmware. */
    uint32_t         crc32;             /**< Announced checksum of the firmware. */
    update_step_t    step;              /**< Current step while WRITING. */
    uint32_t         surveyed;          /**< Number of images surveyed. */
    uint32_t         image_index;       /**< The image being worked on. */
    bool             asked;             /**< The record of this step has been handed to the trial. */
    uint32_t         position;          /**< Bytes of the image that this step has finished. */
    uint32_t         expected;          /**< Length in the header of the image being read, bytes. */
    uint32_t         stored;            /**< Checksum in that header. */
    uint32_t         found;             /**< Checksum computed up to `position`. */
    bool             waiting;           /**< The flash is busy. */
    uint32_t         done;              /**< Bytes erased, programmed and read back so far. */
    uint32_t         total;             /**< Bytes to erase, program and read back altogether. */
} update_t;

/** Prepares updates of a flash, which has a place for records. `memory` is word-aligned and has room for an image. */
void update_init(update_t *update, flash_t *flash, trial_t *trial, uint8_t *memory);

/** Most bytes that a firmware may have. */
uint32_t update_room(const update_t *update);

/** What has become of the newest firmware. */
trial_state_t update_trial(const update_t *update);

/** Whether an update is being checked or written; nothing else may begin until it ends. */
bool update_is_running(const update_t *update);

/** Announces a firmware. Announcing the same one again changes nothing, unless the state is FAILED.
 * STATUS_SIZE if there is no room for it, STATUS_STATE if another one is being written. */
status_t update_begin(update_t *update, uint32_t length, uint32_t crc32);

/** Bytes of the chunk that begins at an offset of the firmware; 0 if none does. */
uint32_t update_chunk_length(const update_t *update, uint32_t offset);

/** Stores a chunk of the firmware that is LOADING: STATUS_STATE, STATUS_OFFSET or STATUS_LENGTH if it does not fit. */
status_t update_store(update_t *update, uint32_t offset, const uint8_t *chunk, uint32_t length);

/** Begins to check and write the firmware; repeating it is no error. STATUS_STATE if none has been announced. */
status_t update_write(update_t *update);

/** Forgets the firmware in memory, unless it is being written. */
void update_forget(update_t *update);

/** Does the next piece of work: a page, or less than a millisecond. To be called often. */
void update_poll(update_t *update, uint64_t clock);

#endif
