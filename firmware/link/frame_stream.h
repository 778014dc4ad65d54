/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The way of a streamed frame to the matcher and back, for who knows no hardware. One frame at a time. */

#ifndef LITESTEREO_LINK_FRAME_STREAM_H
#define LITESTEREO_LINK_FRAME_STREAM_H

#include <stdint.h>

#include "frame_pool.h"
#include "litestereo/status.h"

/** What brings pixel pairs to the matcher past memory, and its map to the host. */
typedef struct {
    void      *context;  /**< First argument of the functions. */
    /** Takes pairs of that frame; STATUS_BUSY while the map of the frame before has not left. */
    status_t (*open)(void *context, const frame_t *frame);
    /** Offset of the pairs that come next of the frame opened last, PROTOCOL_NO_OFFSET once all are in. */
    uint32_t (*wanted)(void *context);
    /** Takes and sends nothing of it any more; the matcher has been stopped before. */
    status_t (*close)(void *context);
} frame_stream_t;

#endif
