/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the parts of the session share: a request on its way to its reply. */

#ifndef LITESTEREO_LINK_EXCHANGE_H
#define LITESTEREO_LINK_EXCHANGE_H

#include "litestereo/session.h"

/** A request and what is becoming of it. */
typedef struct {
    const message_t *request;  /**< What the host asks. */
    uint8_t         *payload;  /**< Room for the payload of the reply, PROTOCOL_CHUNK_SIZE bytes. */
    uint32_t         length;   /**< Bytes of it in use. */
    uint32_t         clock;    /**< Uptime in clocks, modulo 2**32. */
    uint16_t         error;    /**< enum protocol_error; ERROR_NONE where the request was done. */
    uint32_t         detail;   /**< Detail of the error. */
} exchange_t;

/** Answers with an error. */
static inline void refuse(exchange_t *exchange, uint16_t error, uint32_t detail)
{
    exchange->error  = error;
    exchange->detail = detail;
}

/* Requests about the session as a whole, in session.c. */
void session_hello(session_t *session, exchange_t *exchange);
void session_configure(session_t *session, exchange_t *exchange);
void session_statistics(session_t *session, exchange_t *exchange);
void session_bye(session_t *session, exchange_t *exchange);

/* Requests about one frame, in session_frames.c. */
void session_open(session_t *session, exchange_t *exchange);
void session_upload(session_t *session, exchange_t *exchange);
void session_start(session_t *session, exchange_t *exchange);
void session_status(session_t *session, exchange_t *exchange);
void session_read(session_t *session, exchange_t *exchange);
void session_release(session_t *session, exchange_t *exchange);

/** Frees a slot in any state, stopping a match that runs, and counts it as `counter`. */
void session_free(session_t *session, frame_t *frame, enum counter counter);

/** Frees the slots of all frames of the link. */
void session_free_all(session_t *session, enum counter counter);

#endif
