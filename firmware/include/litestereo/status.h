/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_STATUS_H
#define LITESTEREO_STATUS_H

/** What a function of the firmware says about its outcome. */
typedef enum {
    STATUS_OK = 0,        /**< Done. */
    STATUS_BAD_ARGUMENT,  /**< Null pointer, or a value that the function cannot take. */
    STATUS_UNSUPPORTED,   /**< The gateware found is not one that this firmware can drive. */
    STATUS_IDLE,          /**< Nothing is running. */
    STATUS_BUSY,          /**< Something is running already, or still. */
    STATUS_STATE,         /**< The frame is in a state that does not allow it. */
    STATUS_SIZE,          /**< The frame does not fit in a slot. */
    STATUS_NO_SLOT,       /**< All slots are taken. */
    STATUS_OFFSET,        /**< Not the offset of a chunk. */
    STATUS_LENGTH,        /**< Not the length that was expected. */
    STATUS_INCOMPLETE,    /**< Chunks are missing. */
    STATUS_MATCHER,       /**< The accelerator ended the frame with an error. */
    STATUS_TIMEOUT,       /**< A bounded wait came to its end. */
    STATUS_FRAMING,       /**< Not COBS, or too long, or too short. */
    STATUS_HEADER,        /**< Wrong magic or length in a message. */
    STATUS_CRC,           /**< The checksum does not fit the message. */
    STATUS_PROTECTED,     /**< The flash does not let itself be written. */
} status_t;

#endif
