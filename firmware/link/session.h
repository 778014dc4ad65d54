/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The device's side of the link protocol: handles a request and makes its reply. Knows no transport and no hardware. */

#ifndef LITESTEREO_LINK_SESSION_H
#define LITESTEREO_LINK_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "counters.h"
#include "frame_pool.h"
#include "frame_stream.h"
#include "link/protocol/message.h"
#include "link/protocol/peer.h"
#include "link/update/calibrate.h"
#include "link/update/update.h"

/** Departed streamed frames that are remembered, so that a late copy of their STREAM opens no frame. */
#define SESSION_DEPARTED 16u

/** Sessions whose HELLO is remembered, so that a late copy of it begins no session. */
#define SESSION_HELLOS 8u

/** Answers to UDP peers other than the session's: this many at once, then this many per second. */
#define SESSION_STRANGER_BURST 32u
#define SESSION_STRANGER_RATE  8u

/** The HELLO that began a session. */
typedef struct {
    peer_t   peer;   /**< Its sender. */
    uint32_t nonce;  /**< Its nonce. */
} session_hello_t;

/** The device's description of itself in the reply to HELLO; the fields are the protocol's capabilities. */
typedef struct {
    uint16_t    gateware_version;  /**< Major x 256 + minor. */
    uint16_t    firmware_version;  /**< Major x 256 + minor. */
    uint16_t    max_width;         /**< Pixels. */
    uint16_t    max_height;        /**< Pixels. */
    stereo_limits_t limits;        /**< Of the settings. */
    uint32_t    dma_alignment;     /**< Bytes. */
    uint32_t    sys_clk_hz;        /**< Frequency of the clocks that are reported. */
    uint32_t    address;           /**< IPv4 address, 192.168.1.50 is 0xc0a80132; 0 if there is no UDP. */
    uint16_t    port;              /**< UDP port; 0 if there is no UDP. */
    const char *name;              /**< At most PROTOCOL_NAME_SIZE characters of ASCII. */
} device_info_t;

/** Stops the match of a frame that is MATCHING; the frame is DONE or FAILED afterwards. */
typedef void (*session_stop_t)(void *context, frame_t *frame);

/** Gateware that moves images and maps of a UDP session, without the session. The serial line has no such gateware. */
typedef struct {
    void      *context;     /**< First argument of the functions. */
    uint32_t   max_pixels;  /**< Most pixels of a frame that it accepts. */
    const frame_stream_t *stream;  /**< Path of streamed frames; null if there is none. */
    /** Accepts chunks from this peer with this token only; none at all if the token is 0. */
    void     (*set_session)(void *context, uint32_t token, const peer_t *peer);
    /** Accepts chunks of a frame from now on. */
    status_t (*open_frame)(void *context, const frame_t *frame);
    /** Marks in the frame which of its chunks have arrived. */
    void     (*refresh)(void *context, frame_t *frame);
    /** Accepts no more chunks of the frame; when it returns, none is on its way to memory. */
    status_t (*close_frame)(void *context, const frame_t *frame);
    /** Queues `length` bytes of the frame's map, to be sent as replies to the request; false if the queue is full. */
    bool     (*queue_read)(void *context, const peer_t *peer, const message_t *request, const frame_t *frame,
        uint32_t length);
    /** Stops sending the frame's map; when it returns, nothing reads the map. */
    void     (*forget_frame)(void *context, const frame_t *frame);
    /** Brings the counters up to date. */
    void     (*update_counters)(void *context);
} session_transfer_t;

/** A server of the protocol. */
typedef struct {
    const device_info_t *info;           /**< Description of the device. */
    frame_pool_t        *pool;           /**< Slots of the frames. */
    counters_t          *counters;       /**< Counters of the device. */
    session_stop_t       stop;           /**< Called to stop a match. */
    void                *context;        /**< First argument of `stop`. */
    const session_transfer_t *transfer;  /**< Serves UDP peers; null if there is no UDP. */
    update_t            *update;         /**< Replaces the firmware; null if there is no flash. */
    calibrate_t         *calibrate;      /**< The calibration; null if there is no rectification. */
    bool                 restarting;     /**< The device is about to restart; it answers nothing but RESTART. */
    uint64_t             restart_at;     /**< Clock of the restart. */
    peer_t               peer;           /**< Sender of the last HELLO. */
    uint64_t             heard;          /**< Clock when the peer last sent something. */
    uint64_t             counters_updated;  /**< Clock of the last session_update_counters. */
    uint32_t             token;          /**< Token of the session; 0 before the first. */
    bool                 open;           /**< The token is valid: after HELLO, before BYE. */
    uint32_t             nonce;          /**< Nonce of the HELLO. */
    session_hello_t      hellos[SESSION_HELLOS];  /**< HELLOs of the sessions before this one, the last ones. */
    uint32_t             hello_count;    /**< Sessions before this one, modulo 2**32. */
    uint64_t             strangers_served;  /**< Clock up to which answers to strangers have used their rate. */
    uint32_t             random;         /**< State of the generator of tokens; never 0. */
    stereo_settings_t    settings;       /**< Of frames opened from now on, except their size. */
    uint32_t             departed[SESSION_DEPARTED];  /**< Sequences of the STREAMs of the frames that departed last. */
    uint32_t             departed_count; /**< Streamed frames departed in this session, modulo 2**32. */
} session_t;

/** Prepares a server without a session. */
void session_init(session_t *session, const device_info_t *info, frame_pool_t *pool, counters_t *counters,
    session_stop_t stop, void *context);

/** Handles a request that came from `peer` at time `clock`.
 *
 * `clock` also seeds the tokens: pass the uptime, which differs from boot to boot. The reply's payload goes to
 * `payload`, which has room for PROTOCOL_CHUNK_SIZE bytes. Returns whether there is a reply to send. There is none if
 * the message is itself a reply, if gateware sends the replies, or if the sender is a UDP peer that is not the session's
 * and has had its share: SESSION_STRANGER_RATE per second for all of them.
 */
bool session_handle(session_t *session, uint64_t clock, const peer_t *peer, const message_t *request, message_t *reply,
    uint8_t *payload);

/** Updates the counters from time to time; to be called often. */
void session_poll(session_t *session, uint64_t clock);

/** Whether to reset the device now: a host asked for it, and the reply has had time to leave. */
bool session_wants_restart(const session_t *session, uint64_t clock);

/** Brings the counters up to date. Chunks that gateware received keep the session alive. */
void session_update_counters(session_t *session, uint64_t clock);

#endif
