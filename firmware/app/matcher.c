/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "matcher.h"

#include <stddef.h>

#include "litestereo/ensure.h"
#include "litestereo/platform.h"

_Static_assert(FRAME_ALIGNMENT % STEREO_MAX_ALIGNMENT == 0, "slots must suit the DMA");
_Static_assert(PROTOCOL_CHUNK_SIZE % STEREO_MAX_ALIGNMENT == 0, "images must suit the DMA");

stereo_job_t matcher_job(const frame_t *frame)
{
    return (stereo_job_t){
        .left      = frame_left(frame),
        .right     = frame_right(frame),
        .map       = frame_map(frame),
        .settings  = frame->settings,
        .streamed  = frame->streamed,
        .rectified = (frame->options & OPTION_RECTIFIED) != 0,
        .left_out  = frame_left_out(frame),
        .right_out = frame_right_out(frame),
    };
}

/* Gives the job the grid in use, and remembers which one that is. STATUS_BAD_ARGUMENT if it is for another size, or if
 * there is none. */
static status_t choose_grid(matcher_t *matcher, const frame_t *frame, stereo_job_t *job)
{
    const rectification_t *rectification = matcher->rectification;

    matcher->grid_crc = 0;
    if (!job->rectified) {
        return STATUS_OK;
    }
    if (rectification == NULL || !rectification_fits(rectification, frame->settings.width, frame->settings.height)) {
        return STATUS_BAD_ARGUMENT;
    }
    job->grid         = rectification->grid;
    matcher->grid_crc = rectification->calibration.grid_crc;
    return STATUS_OK;
}

static uint16_t flags_of(const frame_t *frame, const stereo_result_t *ended)
{
    return (uint16_t)(((frame->options & OPTION_RECTIFIED) != 0 ? FLAG_RECTIFIED : 0)
        | (ended->row_gone ? FLAG_ROW_GONE : 0) | (ended->folded ? FLAG_FOLDED : 0));
}

static void finish(matcher_t *matcher, frame_t *frame, const frame_result_t *result)
{
    ENSURE(frame_finish(frame, result) == STATUS_OK);
    count(matcher->counters, result->error == ERROR_NONE ? COUNTER_FRAMES_MATCHED : COUNTER_FRAMES_FAILED);
}

/* Closes the path of a streamed frame that failed; the matcher has stopped by now. The wait is bounded. If the path
 * does not close, the open of the next frame reports it. */
static void close_stream(matcher_t *matcher, const frame_t *frame)
{
    if (frame->streamed && matcher->stream != NULL) {
        (void)matcher->stream->close(matcher->stream->context);
    }
}

/* Pairs arrive when the host sends them, so each new offset renews the budget: the protocol's limit for pairs. */
static void watch_pairs(matcher_t *matcher, const frame_t *frame, uint64_t clock)
{
    uint32_t wanted = matcher->stream->wanted(matcher->stream->context);

    if (wanted != matcher->wanted) {
        matcher->wanted = wanted;
        stereo_allow(matcher->stereo, clock, wanted == PROTOCOL_NO_OFFSET
            ? stereo_budget(&frame->settings) : (uint64_t)PROTOCOL_PAIRS_S * clock_hz());
    }
}

static void poll_running(matcher_t *matcher, frame_t *frame, uint64_t clock)
{
    stereo_result_t ended;
    frame_result_t  result = {0};

    if (frame->streamed) {
        watch_pairs(matcher, frame, clock);
    }
    switch (stereo_poll(matcher->stereo, clock, &ended)) {
    case STATUS_BUSY:
        return;
    case STATUS_OK:
        result.clocks           = ended.clocks;
        result.first_row_clocks = ended.first_row_clocks;
        result.flags            = flags_of(frame, &ended);
        result.grid_crc         = matcher->grid_crc;
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
    if (result.error != ERROR_NONE) {
        close_stream(matcher, frame);
    }
    finish(matcher, frame, &result);
}

/* Opens the path of a streamed frame. STATUS_BUSY, for a second at most, until the previous map has been sent; then the
 * path is closed, and opened again. */
static status_t open_stream(matcher_t *matcher, const frame_t *frame, uint64_t clock)
{
    const frame_stream_t *stream = matcher->stream;
    status_t              status = stream != NULL ? stream->open(stream->context, frame) : STATUS_UNSUPPORTED;

    if (status == STATUS_BUSY && !matcher->held) {
        matcher->held_at = clock;
    }
    matcher->held = status == STATUS_BUSY;
    if (matcher->held && clock - matcher->held_at > clock_hz()) {
        matcher->held = false;
        (void)stream->close(stream->context);
        status = stream->open(stream->context, frame);
        status = status == STATUS_BUSY ? STATUS_TIMEOUT : status;
    }
    return status;
}

static status_t begin(matcher_t *matcher, frame_t *frame, uint64_t clock)
{
    stereo_job_t job    = matcher_job(frame);
    status_t     status = frame->streamed ? open_stream(matcher, frame, clock) : STATUS_OK;

    if (matcher->held) {
        return STATUS_OK;
    }
    ENSURE(frame_pool_begin(matcher->pool, frame) == STATUS_OK);
    if (status == STATUS_OK) {
        status = choose_grid(matcher, frame, &job);
    }
    if (status == STATUS_OK) {
        status = stereo_submit(matcher->stereo, &job, clock);
    }
    if (status == STATUS_OK && frame->streamed) {
        matcher->wanted = 0;
        stereo_allow(matcher->stereo, clock, (uint64_t)PROTOCOL_PAIRS_S * clock_hz());
    }
    return status;
}

static void begin_next(matcher_t *matcher, uint64_t clock)
{
    frame_t *frame = frame_pool_next(matcher->pool);

    matcher->held = matcher->held && frame != NULL && frame->streamed;
    if (frame == NULL) {
        return;
    }
    switch (begin(matcher, frame, clock)) {
    case STATUS_OK:
        break;
    case STATUS_BUSY:
    case STATUS_TIMEOUT:
        /* The previous frame could not be stopped. */
        close_stream(matcher, frame);
        finish(matcher, frame, &(frame_result_t){.error = ERROR_TIMEOUT});
        break;
    default:
        close_stream(matcher, frame);
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
    matcher->counters->value[COUNTER_MATCHER_INTERRUPTS] = matcher->stereo->statistics.interrupts;
    matcher->counters->value[COUNTER_MATCHER_TIMEOUTS]   = matcher->stereo->statistics.timeouts;
}

void matcher_stop(matcher_t *matcher, frame_t *frame)
{
    stereo_abort(matcher->stereo);
    close_stream(matcher, frame);
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
