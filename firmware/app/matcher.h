/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Passes frames from the pool to the accelerator, one after the other. */

#ifndef LITESTEREO_APP_MATCHER_H
#define LITESTEREO_APP_MATCHER_H

#include <stdint.h>

#include "link/counters.h"
#include "link/frame_pool.h"
#include "link/frame_stream.h"
#include "litestereo/rectification.h"
#include "litestereo/stereo.h"

/** State of the matcher. */
typedef struct {
    stereo_t     *stereo;    /**< The accelerator. */
    frame_pool_t *pool;      /**< Holds the queued frames. */
    counters_t   *counters;  /**< Counters of the device. */
    const frame_stream_t *stream;  /**< Path of streamed frames; null if there is none. */
    const rectification_t *rectification;  /**< Rectifies frames; null if there is none. */
    uint32_t      wanted;    /**< Of the streamed frame that is MATCHING: offset of the next pairs at the last poll. */
    uint32_t      grid_crc;  /**< Of the grid of the frame that is MATCHING; 0 if it is not rectified. */
    bool          held;      /**< A streamed frame waits until the map of the previous one has been sent. */
    uint64_t      held_at;   /**< Clock when that wait began. */
} matcher_t;

/** The accelerator's job for a frame. */
stereo_job_t matcher_job(const frame_t *frame);

/** Finishes a match that has ended, and begins the next; to be called often. */
void matcher_poll(matcher_t *matcher, uint64_t clock);

/** Stops the match of a frame; the frame is FAILED then. */
void matcher_stop(matcher_t *matcher, frame_t *frame);

/** Queues a complete frame, waits for its end, and returns its final state.
 *
 * Bounded: this frame and each one queued before ends, or is stopped when it exceeds its budget.
 */
frame_state_t matcher_run(matcher_t *matcher, frame_t *frame);

#endif
