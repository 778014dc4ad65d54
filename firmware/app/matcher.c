/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/matcher.h"

#include <stddef.h>

#include "litestereo/platform.h"

_Static_assert(FRAME_ALIGNMENT % STEREO_MAX_ALIGNMENT == 0, "slots must suit the DMA");
_Static_assert(PROTOCOL_CHUNK_SIZE % STEREO_MAX_ALIGNMENT == 0, "images must suit the DMA");

stereo_job_t matcher_job(const frame_t *frame)
{
    return (stereo_job_t){
        .left     = frame_left(frame),
        .right    = frame_right(frame),
        .map      = frame_map(frame),
        .settings = frame->settings,
    };
}

static void finish(matcher_t *matcher, frame_t *frame, const frame_result_t *result)
{
    frame_finish(frame, result);
    count(matcher->counters, result->error == ERROR_NONE ? COUNTER_FRAMES_MATCHED : COUNTER_FRAMES_FAILED);
}

static void poll_running(matcher_t *matcher, frame_t *frame, uint64_t clock)
{
    stereo_result_t ended;
    frame_result_t  result = {0};

    switch (stereo_poll(matcher->stereo, clock, &ended)) {
    case STATUS_BUSY:
        return;
    case STATUS_OK:
        result.clocks           = ended.clocks;
        result.first_row_clocks = ended.first_row_clocks;
        break;
    case STATUS_TIMEOUT:
        result.error  = ERROR_TIMEOUT;
        result.detail = ended.clocks;
        break;
    default:
        result.error  = ERROR_MATCHER;
        result.detail = ended.error;
        break;
    }
    finish(matcher, frame, &result);
}

static void begin_next(matcher_t *matcher, uint64_t clock)
{
    frame_t     *frame = frame_pool_next(matcher->pool);
    stereo_job_t job;

    if (frame == NULL) {
        return;
    }
    job = matcher_job(frame);
    frame_pool_begin(matcher->pool, frame);
    switch (stereo_submit(matcher->stereo, &job, clock)) {
    case STATUS_OK:
        break;
    case STATUS_BUSY:
        /* The frame before could not be stopped: this one has no time to wait for. */
        finish(matcher, frame, &(frame_result_t){.error = ERROR_TIMEOUT});
        break;
    default:
        finish(matcher, frame, &(frame_result_t){.error = ERROR_MATCHER, .detail = STEREO_ERROR_CONFIG});
        break;
    }
}

void matcher_poll(matcher_t *matcher, uint64_t clock)
{
    frame_t *running = frame_pool_matching(matcher->pool);

    if (running != NULL) {
        poll_running(matcher, running, clock);
    }
    if (frame_pool_matching(matcher->pool) == NULL) {
        begin_next(matcher, clock);
    }
    matcher->counters->value[COUNTER_MATCHER_INTERRUPTS] = matcher->stereo->interrupts;
    matcher->counters->value[COUNTER_MATCHER_TIMEOUTS]   = matcher->stereo->timeouts;
}

void matcher_stop(matcher_t *matcher, frame_t *frame)
{
    stereo_abort(matcher->stereo);
    finish(matcher, frame, &(frame_result_t){.error = ERROR_MATCHER, .detail = STEREO_ERROR_ABORTED});
}

frame_state_t matcher_run(matcher_t *matcher, frame_t *frame)
{
    if (frame_pool_start(matcher->pool, frame) != STATUS_OK) {
        return frame->state;
    }
    while (frame->state == FRAME_READY || frame->state == FRAME_MATCHING) {
        matcher_poll(matcher, clock_now());
    }
    return frame->state;
}
