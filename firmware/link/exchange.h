/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the parts of the session share: a request on its way to its reply. */

#ifndef LITESTEREO_LINK_EXCHANGE_H
#define LITESTEREO_LINK_EXCHANGE_H

#include "session.h"

/** A reset comes after this part of a second: what is on its way out has left by then. */
#define RESTARTS_PER_SECOND 10u

/** A request and what is becoming of it. */
typedef struct {
    const message_t *request;  /**< What the host asks. */
    uint8_t         *payload;  /**< Room for the payload of the reply, PROTOCOL_CHUNK_SIZE bytes. */
    uint32_t         length;   /**< Bytes of it in use. */
    uint64_t         clock;    /**< Uptime in clocks. */
    const peer_t    *peer;     /**< Whom the request came from. */
    bool             silent;   /**< There is no reply: it is made past the session, or there is none to make. */
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
void session_start(session_t *session, exchange_t *exchange);
void session_status(session_t *session, exchange_t *exchange);
void session_release(session_t *session, exchange_t *exchange);

/* Requests about pieces of a frame, in session_pieces.c. */
void session_upload(session_t *session, exchange_t *exchange);
void session_missing(session_t *session, exchange_t *exchange);
void session_read(session_t *session, exchange_t *exchange);

/* Requests about a streamed frame, in session_stream.c. */
void session_stream(session_t *session, exchange_t *exchange);

/* Requests about the firmware, in session_update.c; all but the last one need session->update. */
void session_update(session_t *session, exchange_t *exchange);
void session_image(session_t *session, exchange_t *exchange);
void session_write(session_t *session, exchange_t *exchange);
void session_progress(session_t *session, exchange_t *exchange);
void session_restart(session_t *session, exchange_t *exchange);

/** What STATUS reports as first missing: chunks of a stored frame, pairs of a streamed one. */
uint32_t session_first_missing(const session_t *session, const frame_t *frame);

/** Remembers that a frame, if it is a streamed one, leaves. */
void session_note_left(session_t *session, const frame_t *frame);

/** Whether such a frame, begun by a STREAM of that sequence, is remembered. */
bool session_has_left(const session_t *session, uint32_t sequence);

/** Judges, in session_peer.c, whether a request comes from whom the session belongs to; refuses it if not. */
bool session_admit(session_t *session, exchange_t *exchange);

/** What moves images and maps of the session past it; null if it is one of the serial line. */
static inline const session_transfer_t *session_transfer(const session_t *session)
{
    return session->peer.udp ? session->transfer : NULL;
}

/** Most pixels of a frame of the session. */
static inline uint32_t session_max_pixels(const session_t *session)
{
    const session_transfer_t *transfer = session_transfer(session);
    uint32_t                  most     = session->pool->max_pixels;

    return transfer != NULL && transfer->max_pixels < most ? transfer->max_pixels : most;
}

/** Frame of the link with that id; null if there is none. */
static inline frame_t *session_find(session_t *session, uint32_t id)
{
    return frame_pool_find(session->pool, FRAME_OWNER_LINK, id);
}

/** The way of streamed frames of that peer; null if there is none, as on the serial line. */
static inline const frame_stream_t *session_stream_way(const session_t *session, const peer_t *peer)
{
    return peer->udp && session->transfer != NULL ? session->transfer->stream : NULL;
}

/** Opens a frame that is not open yet, or refuses it and returns null; a streamed one is READY at once. */
frame_t *session_open_new(session_t *session, exchange_t *exchange, const stereo_settings_t *settings, bool streamed);

/** Settings of the frame that a request, OPEN or STREAM, wants. */
stereo_settings_t session_settings_of(const session_t *session, const message_t *request);

/** Finds the frame that a request is about, or refuses the request. */
frame_t *session_find_or_refuse(session_t *session, exchange_t *exchange);

/** Learns which chunks of a frame have come past the session. */
void session_refresh(session_t *session, frame_t *frame);

/** Frees a slot in any state, stopping a match that runs, and counts it as `counter`. */
void session_free(session_t *session, frame_t *frame, enum counter counter);

/** Frees the slots of all frames of the link. */
void session_free_all(session_t *session, enum counter counter);

#endif
