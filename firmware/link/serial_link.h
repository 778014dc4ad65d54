/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A serial line shared by framed messages and console text: docs/protocol.md, "Serial framing". */

#ifndef LITESTEREO_LINK_SERIAL_LINK_H
#define LITESTEREO_LINK_SERIAL_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/cobs.h"
#include "session.h"

/** Receives bytes: framed replies for the line, or console text from the line. */
typedef void (*serial_link_bytes_t)(void *context, const uint8_t *bytes, size_t length);

/** The receiver and sender of one line. */
typedef struct {
    session_t          *session;         /**< Answers messages. */
    counters_t         *counters;        /**< Counters of the device. */
    serial_link_bytes_t write;           /**< Sends bytes on the line. */
    void               *write_context;   /**< First argument of `write`. */
    serial_link_bytes_t console;         /**< Receives console text, without zero bytes. */
    void               *console_context; /**< First argument of `console`. */
    uint64_t            timeout;         /**< Clocks of silence after which an incomplete frame is dropped. */
    uint64_t            heard;           /**< Clock when the last byte arrived. */
    bool                in_frame;        /**< Inside of a frame; else bytes are console text. */
    cobs_decoder_t      decoder;         /**< Decodes into `message`. */
    uint32_t            message[(PROTOCOL_MESSAGE_MAX + 3) / 4];  /**< Received message, in words for fast copies. */
    uint32_t            reply[(PROTOCOL_MESSAGE_MAX + 3) / 4];    /**< Reply to it. */
    uint8_t             framed[COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2];  /**< Reply as it goes on the line. */
} serial_link_t;

/** Prepares the link, outside of a frame. `clock_hz` is the frequency of the `clock` arguments. */
void serial_link_init(serial_link_t *link, session_t *session, counters_t *counters, uint32_t clock_hz);

/** Handles bytes from the line at time `clock`, and answers complete messages. */
void serial_link_receive(serial_link_t *link, uint64_t clock, const uint8_t *bytes, size_t length);

/** Drops an incomplete frame after a second of silence; to be called while no bytes arrive. */
void serial_link_poll(serial_link_t *link, uint64_t clock);

#endif
