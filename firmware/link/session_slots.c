/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What several requests do with a slot: find its frame, open it, bring it up to date, free it. */

#include "exchange.h"
#include "lib/bytes.h"

frame_t *session_find_or_refuse(session_t *session, exchange_t *exchange)
{
    frame_t *frame = session_find(session, exchange->request->frame_id);

    if (frame == NULL) {
        refuse(exchange, ERROR_FRAME, exchange->request->frame_id);
    }
    return frame;
}

void session_refresh(session_t *session, frame_t *frame)
{
    if (session_is_udp(session) && frame->state == FRAME_LOADING) {
        session->transfer->refresh(session->transfer->context, frame);
    }
}

void session_free(session_t *session, frame_t *frame, enum counter counter)
{
    const session_transfer_t *transfer = session->transfer;

    if (frame->state == FRAME_MATCHING) {
        session->stop(session->context, frame);
    }
    if (session_is_udp(session)) {
        /* Both waits are bounded. The slot is freed even if gateware does not stop: it is broken then, but without
         * slots the device would be of no use to the serial line either. */
        if (frame->state == FRAME_LOADING) {
            (void)transfer->close_frame(transfer->context, frame);
        }
        transfer->forget_frame(transfer->context, frame);
    }
    session_remember_departed(session, frame);
    if (frame_release(frame) == STATUS_OK) {
        count(session->counters, counter);
    }
}

void session_free_all(session_t *session, enum counter counter)
{
    for (unsigned slot = 0; slot < session->pool->slots; slot++) {
        if (session->pool->frame[slot].owner == FRAME_OWNER_LINK) {
            session_free(session, &session->pool->frame[slot], counter);
        }
    }
}

/* enum protocol_size: why a frame of this size cannot be matched; 0 if it can. */
static uint32_t size_problem(const session_t *session, const stereo_settings_t *settings)
{
    if (settings->width > session->info->max_width) {
        return SIZE_TOO_WIDE;
    }
    if (settings->height > session->info->max_height) {
        return SIZE_TOO_HIGH;
    }
    if ((uint32_t)settings->width * settings->height > session_max_pixels(session)) {
        return SIZE_TOO_LARGE;
    }
    if (settings->width < stereo_settings_min_width(settings)) {
        return SIZE_TOO_NARROW;
    }
    if (settings->height < settings->block_size) {
        return SIZE_TOO_LOW;
    }
    return 0;
}

frame_t *session_open_new(session_t *session, exchange_t *exchange, const stereo_settings_t *settings, uint8_t options,
    bool streamed)
{
    const session_transfer_t *transfer = session->transfer;
    uint32_t                  problem  = size_problem(session, settings);
    frame_t                  *frame;

    if (problem != 0) {
        refuse(exchange, ERROR_SIZE, problem);
        return NULL;
    }
    if (frame_pool_open(session->pool, FRAME_OWNER_LINK, exchange->request->frame_id, settings, &frame) != STATUS_OK) {
        refuse(exchange, ERROR_NO_SLOT, session->pool->slots);
        return NULL;
    }
    if (frame_set_options(session->pool, frame, options) != STATUS_OK) {
        frame_release(frame);
        refuse(exchange, ERROR_SIZE, SIZE_TOO_LARGE);
        return NULL;
    }
    if (streamed) {
        frame_pool_stream(session->pool, frame, exchange->request->sequence);
    } else if (session_is_udp(session) && transfer->open_frame(transfer->context, frame) != STATUS_OK) {
        frame_release(frame);
        refuse(exchange, ERROR_TIMEOUT, 0);
        return NULL;
    }
    count(session->counters, COUNTER_FRAMES_OPENED);
    return frame;
}

/* Whether the device can serve these options for a frame of this size now; refuses them if not. */
static bool admit_options(const session_t *session, exchange_t *exchange, const stereo_settings_t *settings,
    uint16_t options)
{
    const calibrate_t *calibrate = session->calibrate;

    if ((options & ~OPTIONS_ALL) != 0) {
        refuse(exchange, ERROR_FEATURE, 0);
        return false;
    }
    if ((options & OPTION_RECTIFIED) != 0
        && !rectification_fits(calibrate->rectification, settings->width, settings->height)) {
        const calibration_t *in_use = &calibrate->rectification->calibration;

        refuse(exchange, ERROR_CALIBRATION, (uint32_t)in_use->width << 16 | in_use->height);
        return false;
    }
    return true;
}

bool session_wanted(const session_t *session, exchange_t *exchange, stereo_settings_t *settings, uint8_t *options)
{
    const message_t *request = exchange->request;
    uint16_t         asked;

    /* Without rectification there are no options. */
    if (request->length != 4 && (request->length != 8 || session->calibrate == NULL)) {
        refuse(exchange, ERROR_LENGTH, 4);
        return false;
    }
    *settings        = session->settings;
    settings->width  = get_u16(request->payload);
    settings->height = get_u16(request->payload + 2);
    asked            = request->length == 8 ? get_u16(request->payload + 4) : 0;
    *options         = (uint8_t)asked;
    return admit_options(session, exchange, settings, asked);
}

bool session_is_same(const frame_t *frame, const stereo_settings_t *settings, uint8_t options)
{
    return frame->settings.width == settings->width && frame->settings.height == settings->height
        && frame->options == options;
}

uint32_t session_first_missing(const session_t *session, const frame_t *frame)
{
    const frame_stream_t *stream = session_stream_path(session, &session->peer);

    if (!frame->streamed || stream == NULL) {
        return frame_first_missing(frame);
    }
    if (frame->state == FRAME_READY) {
        return 0;
    }
    return frame->state == FRAME_MATCHING ? stream->wanted(stream->context) : PROTOCOL_NO_OFFSET;
}

void session_remember_departed(session_t *session, const frame_t *frame)
{
    if (frame->streamed) {
        session->departed[session->departed_count++ % SESSION_DEPARTED] = frame->sequence;
    }
}

bool session_has_departed(const session_t *session, uint32_t sequence)
{
    for (uint32_t i = 0; i < SESSION_DEPARTED && i < session->departed_count; i++) {
        if (session->departed[i] == sequence) {
            return true;
        }
    }
    return false;
}
