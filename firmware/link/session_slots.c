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
    const session_transfer_t *transfer = session_transfer(session);

    if (transfer != NULL && frame->state == FRAME_LOADING) {
        transfer->refresh(transfer->context, frame);
    }
}

void session_free(session_t *session, frame_t *frame, enum counter counter)
{
    const session_transfer_t *transfer = session_transfer(session);

    if (frame->state == FRAME_MATCHING) {
        session->stop(session->context, frame);
    }
    if (transfer != NULL) {
        /* Both waits are bounded, and the slot is freed at their end all the same: gateware that does not even stop
         * is broken, and a device without slots would be of no use to the serial line either. */
        if (frame->state == FRAME_LOADING) {
            (void)transfer->close(transfer->context, frame);
        }
        transfer->forget(transfer->context, frame);
    }
    session_note_left(session, frame);
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

/* enum protocol_size of what keeps a frame from being matched; 0 if nothing does. */
static uint32_t judge_size(const session_t *session, const stereo_settings_t *settings)
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

frame_t *session_open_new(session_t *session, exchange_t *exchange, const stereo_settings_t *settings, bool streamed)
{
    const session_transfer_t *transfer = session_transfer(session);
    uint32_t                  problem  = judge_size(session, settings);
    frame_t                  *frame;

    if (problem != 0) {
        refuse(exchange, ERROR_SIZE, problem);
        return NULL;
    }
    if (frame_pool_open(session->pool, FRAME_OWNER_LINK, exchange->request->frame_id, settings, &frame) != STATUS_OK) {
        refuse(exchange, ERROR_NO_SLOT, session->pool->slots);
        return NULL;
    }
    if (streamed) {
        frame_pool_stream(session->pool, frame, exchange->request->sequence);
    } else if (transfer != NULL && transfer->open(transfer->context, frame) != STATUS_OK) {
        frame_release(frame);
        refuse(exchange, ERROR_TIMEOUT, 0);
        return NULL;
    }
    count(session->counters, COUNTER_FRAMES_OPENED);
    return frame;
}

stereo_settings_t session_settings_of(const session_t *session, const message_t *request)
{
    stereo_settings_t settings = session->settings;

    settings.width  = get_u16(request->payload);
    settings.height = get_u16(request->payload + 2);
    return settings;
}

uint32_t session_first_missing(const session_t *session, const frame_t *frame)
{
    const frame_stream_t *stream = session_stream_way(session, &session->peer);

    if (!frame->streamed || stream == NULL) {
        return frame_first_missing(frame);
    }
    if (frame->state == FRAME_READY) {
        return 0;
    }
    return frame->state == FRAME_MATCHING ? stream->wanted(stream->context) : PROTOCOL_NO_OFFSET;
}

void session_note_left(session_t *session, const frame_t *frame)
{
    if (frame->streamed) {
        session->streams[session->streams_left++ % SESSION_STREAMS] = frame->sequence;
    }
}

bool session_has_left(const session_t *session, uint32_t sequence)
{
    for (uint32_t i = 0; i < SESSION_STREAMS && i < session->streams_left; i++) {
        if (session->streams[i] == sequence) {
            return true;
        }
    }
    return false;
}
