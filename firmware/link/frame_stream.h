/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The path of a streamed frame to the matcher and back, free of hardware. One frame at a time. */

#ifndef LITESTEREO_LINK_FRAME_STREAM_H
#define LITESTEREO_LINK_FRAME_STREAM_H

#include <stdint.h>

#include "frame_pool.h"
#include "litestereo/status.h"

/** Brings pixel pairs directly to the matcher, and its map to the host. */
typedef struct {
    void      *context;  /**< First argument of the functions. */
    /** Accepts pairs of this frame; STATUS_BUSY until the map of the previous frame has been sent. */
    status_t (*open)(void *context, const frame_t *frame);
    /** Offset of the next pairs of the frame opened last; PROTOCOL_NO_OFFSET once all have arrived. */
    uint32_t (*wanted)(void *context);
    /** Accepts no more pairs and sends no more of the map; to be called after the matcher has stopped. */
    status_t (*close)(void *context);
} frame_stream_t;

#endif
