/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The device's side of the link protocol: takes a request, gives its reply. Knows no transport and no hardware. */

#ifndef LITESTEREO_SESSION_H
#define LITESTEREO_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/counters.h"
#include "litestereo/frame_pool.h"
#include "litestereo/message.h"

/** What the device tells of itself in hello; the fields are those of the protocol's capabilities. */
typedef struct {
    uint16_t    gateware_version;  /**< Major x 256 + minor. */
    uint16_t    firmware_version;  /**< Likewise. */
    uint16_t    max_width;         /**< Pixels. */
    uint16_t    max_height;        /**< Pixels. */
    stereo_limits_t limits;        /**< Of the settings. */
    uint32_t    sys_clk_hz;        /**< Frequency of the clocks that are reported. */
    const char *name;              /**< At most PROTOCOL_NAME_SIZE characters of ASCII. */
} device_info_t;

/** Stops the match of a frame that is MATCHING; the frame is DONE or FAILED when it returns. */
typedef void (*session_stop_t)(void *context, frame_t *frame);

/** A server of the protocol. */
typedef struct {
    const device_info_t *info;           /**< What the device is. */
    frame_pool_t        *pool;           /**< Where frames live. */
    counters_t          *counters;       /**< What is counted. */
    session_stop_t       stop;           /**< Called to stop a match. */
    void                *context;        /**< First argument of `stop`. */
    uint32_t             token;          /**< Token of the session; 0 before the first. */
    bool                 open;           /**< The token is valid: hello came, bye did not. */
    bool                 fresh;          /**< No other request came since the hello. */
    uint32_t             nonce;          /**< Nonce of the hello. */
    uint32_t             random;         /**< State that tokens are drawn from; never 0. */
    stereo_settings_t    settings;       /**< Of the frames opened next, but for their size. */
} session_t;

/** Prepares a server without a session. */
void session_init(session_t *session, const device_info_t *info, frame_pool_t *pool, counters_t *counters,
    session_stop_t stop, void *context);

/** Does what a request asks.
 *
 * `clock` is any number that differs from boot to boot, best the uptime in clocks: tokens are drawn with it.
 * `payload` has room for PROTOCOL_CHUNK_SIZE bytes and is where the payload of the reply goes.
 * Returns whether there is a reply: a message that is itself a reply gets none.
 */
bool session_handle(session_t *session, uint32_t clock, const message_t *request, message_t *reply, uint8_t *payload);

#endif
