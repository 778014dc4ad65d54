/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Shared by the files of the session: a request on its way to its reply. */

#ifndef LITESTEREO_LINK_EXCHANGE_H
#define LITESTEREO_LINK_EXCHANGE_H

#include "session.h"

/** Milliseconds from a RESTART to the reset, so that the reply leaves first. */
#define RESTART_DELAY_MS 100u

/** A request and its reply in the making. */
typedef struct {
    const message_t *request;  /**< The host's request. */
    uint8_t         *payload;  /**< Room for the payload of the reply, PROTOCOL_CHUNK_SIZE bytes. */
    uint32_t         length;   /**< Bytes of it in use. */
    uint64_t         clock;    /**< Uptime in clocks. */
    const peer_t    *peer;     /**< The sender of the request. */
    bool             no_reply; /**< The session sends no reply: gateware does, or there is none. */
    uint16_t         error;    /**< enum protocol_error; ERROR_NONE if the request succeeded. */
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

/* Requests about chunks and parts of a frame, in session_pieces.c. */
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

/* Requests about the calibration, in session_calibration.c; all need session->calibrate. */
void session_calibrate(session_t *session, exchange_t *exchange);
void session_record(session_t *session, exchange_t *exchange);
void session_adopt(session_t *session, exchange_t *exchange);
void session_calibration(session_t *session, exchange_t *exchange);
void session_recall(session_t *session, exchange_t *exchange);
void session_forget(session_t *session, exchange_t *exchange);

/** What STATUS reports as first missing: chunks of a stored frame, pairs of a streamed one. */
uint32_t session_first_missing(const session_t *session, const frame_t *frame);

/** Remembers the departure of a frame if it is streamed. */
void session_remember_departed(session_t *session, const frame_t *frame);

/** Whether the STREAM with that sequence opened a frame that has departed. */
bool session_has_departed(const session_t *session, uint32_t sequence);

/** Whether a request is the session's, or may begin a session; refuses it if not. In session_peer.c. */
bool session_admit(session_t *session, exchange_t *exchange);

/** Whether there is a reply: always for the session's host and on the serial line, at a bounded rate for others. In
 * session_peer.c. */
bool session_may_answer(session_t *session, const exchange_t *exchange);

/** Remembers the HELLO of a session that ends because another begins. In session_peer.c. */
void session_remember_hello(session_t *session);

/** Whether a HELLO is one of those. In session_peer.c. */
bool session_has_said_hello(const session_t *session, const peer_t *peer, uint32_t nonce);

/** Whether the session's host is at UDP, so that gateware moves images and maps; else it is at the serial line. */
static inline bool session_is_udp(const session_t *session)
{
    return session->peer.udp && session->transfer != NULL;
}

/** Most pixels of a frame of the session. */
static inline uint32_t session_max_pixels(const session_t *session)
{
    uint32_t most = session->pool->max_pixels;

    return session_is_udp(session) && session->transfer->max_pixels < most ? session->transfer->max_pixels : most;
}

/** Frame of the link with this id; null if there is none. */
static inline frame_t *session_find(session_t *session, uint32_t id)
{
    return frame_pool_find(session->pool, FRAME_OWNER_LINK, id);
}

/** Path of streamed frames for this peer; null if there is none, as on the serial line. */
static inline const frame_stream_t *session_stream_path(const session_t *session, const peer_t *peer)
{
    return peer->udp && session->transfer != NULL ? session->transfer->stream : NULL;
}

/** Opens a new frame, or refuses the request and returns null; a streamed frame is READY at once. */
frame_t *session_open_new(session_t *session, exchange_t *exchange, const stereo_settings_t *settings, uint8_t options,
    bool streamed);

/** Whether an OPEN or a STREAM asks for a frame like this one. */
bool session_is_same(const frame_t *frame, const stereo_settings_t *settings, uint8_t options);

/** Reads what an OPEN or a STREAM asks for, or refuses it and returns false: its length, or options that the device cannot
 * serve. */
bool session_wanted(const session_t *session, exchange_t *exchange, stereo_settings_t *settings, uint8_t *options);

/** Finds the frame that a request is about, or refuses the request. */
frame_t *session_find_or_refuse(session_t *session, exchange_t *exchange);

/** Marks the chunks of a frame that gateware has received. */
void session_refresh(session_t *session, frame_t *frame);

/** Frees the slot of a frame in any state, and counts it as `counter`; stops its match if one runs. */
void session_free(session_t *session, frame_t *frame, enum counter counter);

/** Frees the slots of all frames of the link. */
void session_free_all(session_t *session, enum counter counter);

#endif
