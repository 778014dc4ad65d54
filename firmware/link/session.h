/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The device's side of the link protocol: takes a request, gives its reply. Knows no transport and no hardware. */

#ifndef LITESTEREO_LINK_SESSION_H
#define LITESTEREO_LINK_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "counters.h"
#include "frame_pool.h"
#include "frame_stream.h"
#include "link/protocol/message.h"
#include "link/protocol/peer.h"
#include "link/update/update.h"

/** Streamed frames that have left and are remembered, so that a late copy of their STREAM begins nothing. */
#define SESSION_STREAMS 16u

/** What the device tells of itself in hello; the fields are those of the protocol's capabilities. */
typedef struct {
    uint16_t    gateware_version;  /**< Major x 256 + minor. */
    uint16_t    firmware_version;  /**< Likewise. */
    uint16_t    max_width;         /**< Pixels. */
    uint16_t    max_height;        /**< Pixels. */
    stereo_limits_t limits;        /**< Of the settings. */
    uint32_t    sys_clk_hz;        /**< Frequency of the clocks that are reported. */
    uint32_t    address;           /**< IPv4 address, 192.168.1.50 is 0xc0a80132; 0 if there is no UDP. */
    uint16_t    port;              /**< UDP port; 0 likewise. */
    const char *name;              /**< At most PROTOCOL_NAME_SIZE characters of ASCII. */
} device_info_t;

/** Stops the match of a frame that is MATCHING; the frame is DONE or FAILED when it returns. */
typedef void (*session_stop_t)(void *context, frame_t *frame);

/** What moves images and maps of sessions over UDP past the session; a serial line has nothing of that kind. */
typedef struct {
    void      *context;     /**< First argument of the functions. */
    uint32_t   max_pixels;  /**< Most pixels of a frame that it takes. */
    const frame_stream_t *stream;  /**< The way of streamed frames; null if there is none. */
    /** Takes chunks of nobody but that peer and token from now on; of nobody at all if the token is 0. */
    void     (*begin)(void *context, uint32_t token, const peer_t *peer);
    /** Takes chunks of a frame, which none has come of. */
    status_t (*open)(void *context, const frame_t *frame);
    /** Notes in the frame which of its chunks have come. */
    void     (*refresh)(void *context, frame_t *frame);
    /** Takes chunks of the frame no longer; none is on its way to memory when it returns. */
    status_t (*close)(void *context, const frame_t *frame);
    /** Puts `length` bytes of the frame's map in line, to be sent as replies to the request; false if it is full. */
    bool     (*read)(void *context, const peer_t *peer, const message_t *request, const frame_t *frame,
        uint32_t length);
    /** Sends nothing of the frame's map any more; nothing reads it when it returns. */
    void     (*forget)(void *context, const frame_t *frame);
    /** Brings the counters up to date. */
    void     (*count)(void *context);
} session_transfer_t;

/** A server of the protocol. */
typedef struct {
    const device_info_t *info;           /**< What the device is. */
    frame_pool_t        *pool;           /**< Where frames live. */
    counters_t          *counters;       /**< What is counted. */
    session_stop_t       stop;           /**< Called to stop a match. */
    void                *context;        /**< First argument of `stop`. */
    const session_transfer_t *transfer;  /**< What serves peers of UDP; null if there is no UDP. */
    update_t            *update;         /**< What replaces the firmware; null if there is no flash. */
    bool                 restarting;     /**< The device is about to begin anew, and answers nothing but RESTART. */
    uint64_t             restart_at;     /**< Clock when it does. */
    peer_t               peer;           /**< Who said hello. */
    uint64_t             heard;          /**< Clock when something last came from it. */
    uint64_t             looked;         /**< Clock when session_poll last looked for chunks. */
    uint32_t             token;          /**< Token of the session; 0 before the first. */
    bool                 open;           /**< The token is valid: hello came, bye did not. */
    uint32_t             nonce;          /**< Nonce of the hello. */
    uint32_t             random;         /**< State that tokens are drawn from; never 0. */
    stereo_settings_t    settings;       /**< Of the frames opened next, but for their size. */
    uint32_t             streams[SESSION_STREAMS];  /**< Sequences of the STREAMs of the last frames that have left. */
    uint32_t             streams_left;   /**< Number of such frames, modulo 2**32. */
} session_t;

/** Prepares a server without a session. */
void session_init(session_t *session, const device_info_t *info, frame_pool_t *pool, counters_t *counters,
    session_stop_t stop, void *context);

/** Does what a request asks that came from `peer` at time `clock`.
 *
 * Tokens are drawn with the clock, so it is best the uptime, which differs from boot to boot.
 * `payload` has room for PROTOCOL_CHUNK_SIZE bytes and is where the payload of the reply goes.
 * Returns whether there is a reply: a message that is itself a reply gets none, nor does a request that is answered
 * past the session.
 */
bool session_handle(session_t *session, uint64_t clock, const peer_t *peer, const message_t *request, message_t *reply,
    uint8_t *payload);

/** Notices from time to time that chunks come past the session; to be called often. */
void session_poll(session_t *session, uint64_t clock);

/** Whether the device is to be reset now: somebody asked for it, and the reply has had its time to leave. */
bool session_wants_restart(const session_t *session, uint64_t clock);

/** Brings the counters up to date, and notices chunks that came past the session. */
void session_look(session_t *session, uint64_t clock);

#endif
