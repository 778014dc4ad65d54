/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_STATUS_H
#define LITESTEREO_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

/** Outcome of a function. */
typedef enum {
    STATUS_OK = 0,        /**< Done. */
    STATUS_BAD_ARGUMENT,  /**< Null pointer, or a value that is not allowed. */
    STATUS_UNSUPPORTED,   /**< The hardware is absent, or not supported by this firmware. */
    STATUS_IDLE,          /**< Nothing runs. */
    STATUS_BUSY,          /**< An operation already runs, or has not ended. */
    STATUS_STATE,         /**< Not allowed in the current state. */
    STATUS_SIZE,          /**< The frame does not fit in a slot. */
    STATUS_NO_SLOT,       /**< All slots are taken. */
    STATUS_OFFSET,        /**< Not the offset of a chunk. */
    STATUS_LENGTH,        /**< Not the expected length. */
    STATUS_INCOMPLETE,    /**< Chunks are missing. */
    STATUS_MATCHER,       /**< The accelerator ended the frame with an error. */
    STATUS_TIMEOUT,       /**< A bounded wait expired. */
    STATUS_FRAMING,       /**< Not COBS, or too long, or too short. */
    STATUS_HEADER,        /**< Wrong magic or length in a message. */
    STATUS_CRC,           /**< The checksum does not match. */
    STATUS_PROTECTED,     /**< The flash is write-protected. */
    STATUS_NO_RECORD,     /**< The flash has no such record. */
    STATUS_ROWS,          /**< The map of a rectification needs more rows than gateware keeps. */
} status_t;

/** Name of a status for messages, such as "timeout"; "unknown" for a number that is none. */
const char *status_name(status_t status);

#ifdef __cplusplus
}
#endif

#endif
