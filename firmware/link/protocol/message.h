/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_LINK_PROTOCOL_MESSAGE_H
#define LITESTEREO_LINK_PROTOCOL_MESSAGE_H

#include <stddef.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "protocol.h"

/** The fields of a message. */
typedef struct {
    uint8_t        version;   /**< PROTOCOL_VERSION, or that of another sender. */
    uint8_t        type;      /**< enum protocol_type, with or without PROTOCOL_REPLY_BIT. */
    uint32_t       session;   /**< Token of the session; 0 in hello. */
    uint32_t       sequence;  /**< Number of the request; its reply has the same. */
    uint32_t       frame_id;  /**< Frame that the message is about; 0 for none. */
    uint32_t       offset;    /**< Byte offset of the payload in the upload or download space. */
    uint32_t       length;    /**< Bytes of payload, 0 to PROTOCOL_CHUNK_SIZE. */
    const uint8_t *payload;   /**< `length` bytes. */
} message_t;

/** Parses `length` received bytes; the payload stays where it is.
 *
 * Returns STATUS_FRAMING if no message has this length, STATUS_HEADER or STATUS_CRC if the bytes are damaged; `message`
 * is written on STATUS_OK only. The caller checks the version.
 */
status_t message_parse(const uint8_t *bytes, size_t length, message_t *message);

/** Builds a message in `buffer`, which has room for PROTOCOL_MESSAGE_MAX; returns its length in bytes.
 *
 * The payload is copied unless it is at `buffer` + PROTOCOL_HEADER_SIZE already.
 */
size_t message_build(const message_t *message, uint8_t *buffer);

#endif
