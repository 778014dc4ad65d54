/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Takes frames from the pool to the accelerator, one after the other. */

#ifndef LITESTEREO_APP_MATCHER_H
#define LITESTEREO_APP_MATCHER_H

#include <stdint.h>

#include "link/counters.h"
#include "link/frame_pool.h"
#include "link/frame_stream.h"
#include "litestereo/stereo.h"

/** The way between pool and accelerator. */
typedef struct {
    stereo_t     *stereo;    /**< The accelerator. */
    frame_pool_t *pool;      /**< Where frames wait. */
    counters_t   *counters;  /**< What is counted. */
    const frame_stream_t *stream;  /**< The way of streamed frames; null if there is none. */
    uint32_t      wanted;    /**< Of the streamed frame that is MATCHING: the pairs that were wanted at the last look. */
    bool          held;      /**< A streamed frame is held up by the one before, whose map has not left. */
    uint64_t      held_at;   /**< Clock since when. */
} matcher_t;

/** The accelerator's job for a frame. */
stereo_job_t matcher_job(const frame_t *frame);

/** Ends the match that is over, if one is, and begins the next; to be called often. */
void matcher_poll(matcher_t *matcher, uint64_t clock);

/** Stops the match of a frame, which is FAILED then. */
void matcher_stop(matcher_t *matcher, frame_t *frame);

/** Puts a complete frame in line, waits for its end and returns the frame's last state.
 *
 * Bounded: every frame before it is done or stopped by the watchdog in the end, and so is this one.
 */
frame_state_t matcher_run(matcher_t *matcher, frame_t *frame);

#endif
