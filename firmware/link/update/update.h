/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* An update: another firmware comes to memory, is checked there, and replaces all images in flash.
 *
 *   EMPTY -> LOADING -> CHECKING -> WRITING -> DONE
 *                          |           |
 *                          +-----------+-----> FAILED
 *
 * The boot program starts the first good image. That one is written last, when all others hold the new firmware and have
 * been read back; so there is a good image at every moment, whenever the power fails. Of each image the header's sector is
 * erased first and its page programmed last: nothing that is half there looks like an image.
 */

#ifndef LITESTEREO_LINK_UPDATE_UPDATE_H
#define LITESTEREO_LINK_UPDATE_UPDATE_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/flash.h"
#include "litestereo/status.h"

/** Bytes of an image before the firmware: its length and its CRC-32. */
#define UPDATE_HEADER_SIZE 8u

/** States of an update, as the link protocol numbers them. */
typedef enum {
    UPDATE_EMPTY    = 0,  /**< There is none. */
    UPDATE_LOADING  = 1,  /**< The firmware comes. */
    UPDATE_CHECKING = 2,  /**< What has come is checked; the flash has not been touched. */
    UPDATE_WRITING  = 3,  /**< Images are being replaced. */
    UPDATE_DONE     = 4,  /**< All images are the new firmware. */
    UPDATE_FAILED   = 5,  /**< It was given up; at least one image is as good as before. */
} update_state_t;

/** Why an update has failed, as the link protocol numbers it. */
typedef enum {
    UPDATE_NO_FAILURE = 0,
    UPDATE_CHECKSUM   = 1,  /**< What has come is not what was announced. */
    UPDATE_FOREIGN    = 2,  /**< It is no firmware for this SoC. */
    UPDATE_PROTECTED  = 3,  /**< The flash does not let itself be written. */
    UPDATE_TIMEOUT    = 4,  /**< The flash did not come to rest. */
    UPDATE_VERIFY     = 5,  /**< The flash holds something else than was written. */
} update_failure_t;

/** What is done at present with one image. */
typedef enum { UPDATE_SURVEY, UPDATE_ERASE, UPDATE_PROGRAM, UPDATE_READ_BACK } update_step_t;

/** The update of a device. */
typedef struct {
    flash_t         *flash;     /**< Where to. */
    uint8_t         *image;     /**< The image in memory, as it will be in flash. */
    update_state_t   state;     /**< Changed by the functions below only. */
    update_failure_t failure;   /**< If it is FAILED. */
    uint32_t         length;    /**< Bytes of the firmware, */
    uint32_t         crc32;     /**< and its checksum, as announced. */
    update_step_t    step;      /**< While it is WRITING. */
    uint32_t         turn;      /**< Images that have been written. */
    uint32_t         slot;      /**< Number of the image at work. */
    uint32_t         last;      /**< Number of the image that is written last. */
    uint32_t         position;  /**< Bytes of it that are through. */
    uint32_t         expected;  /**< Of an image that is read: bytes of its firmware, */
    uint32_t         stored;    /**< and its checksum as it says; */
    uint32_t         found;     /**< the checksum up to the position. */
    bool             waiting;   /**< The flash is at work. */
    uint32_t         done;      /**< Bytes erased, programmed and read back, */
    uint32_t         total;     /**< and all that will be. */
} update_t;

/** Prepares updates to a flash; `memory` is aligned to words, and has room for an image. */
void update_init(update_t *update, flash_t *flash, uint8_t *memory);

/** Most bytes that a firmware may have. */
uint32_t update_room(const update_t *update);

/** Whether the flash is at work, or about to be; until it is not, nothing else may begin. */
bool update_is_running(const update_t *update);

/** Announces a firmware. One that is announced already, in whatever state but FAILED, stays as it is.
 * STATUS_SIZE if there is no room for it, STATUS_STATE if another one is being written. */
status_t update_begin(update_t *update, uint32_t length, uint32_t crc32);

/** Bytes of the chunk that begins at an offset of the firmware; 0 if none does. */
uint32_t update_chunk_length(const update_t *update, uint32_t offset);

/** Takes a chunk of the firmware that is LOADING: STATUS_STATE, STATUS_OFFSET or STATUS_LENGTH if it is none. */
status_t update_take(update_t *update, uint32_t offset, const uint8_t *chunk, uint32_t length);

/** Begins to check and write what has come; once more is no error. STATUS_STATE if nothing has been announced. */
status_t update_write(update_t *update);

/** Forgets the firmware in memory, unless it is being written. */
void update_forget(update_t *update);

/** Does the next piece of work, a page's or less than a millisecond of it; to be called often. */
void update_poll(update_t *update, uint64_t clock);

#endif
