/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

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

void session_open(session_t *session, exchange_t *exchange)
{
    const message_t  *request  = exchange->request;
    frame_t          *frame    = session_find(session, request->frame_id);
    stereo_settings_t settings = session_settings_of(session, request);

    if (request->frame_id == 0) {
        refuse(exchange, ERROR_FRAME, 0);
        return;
    }
    if (frame == NULL) {
        frame = session_open_new(session, exchange, &settings, false);
        if (frame == NULL) {
            return;
        }
    } else if (frame->state != FRAME_LOADING || frame->settings.width != settings.width
        || frame->settings.height != settings.height) {
        refuse(exchange, ERROR_DUPLICATE, request->frame_id);
        return;
    }
    put_u16(exchange->payload, frame->slot);
    put_u16(exchange->payload + 2, 0);
    put_u32(exchange->payload + 4, frame->pitch);
    exchange->length = 8;
}

void session_start(session_t *session, exchange_t *exchange)
{
    const session_transfer_t *transfer = session_transfer(session);
    frame_t                  *frame    = session_find_or_refuse(session, exchange);

    /* A frame that is past LOADING has been started, so this is the request once more. */
    if (frame == NULL || frame->state != FRAME_LOADING) {
        return;
    }
    session_refresh(session, frame);
    if (frame->missing != 0) {
        refuse(exchange, ERROR_INCOMPLETE, frame_first_missing(frame));
        return;
    }
    if (transfer != NULL && transfer->close(transfer->context, frame) != STATUS_OK) {
        refuse(exchange, ERROR_TIMEOUT, 0);
        return;
    }
    frame_pool_start(session->pool, frame);
}

void session_status(session_t *session, exchange_t *exchange)
{
    frame_t *frame = session_find(session, exchange->request->frame_id);
    uint8_t *out   = exchange->payload;

    memset(out, 0, PROTOCOL_STATUS_SIZE);
    put_u32(out + 12, PROTOCOL_NO_OFFSET);
    if (frame != NULL) {
        session_refresh(session, frame);
        out[0] = (uint8_t)frame->state;
        out[1] = frame->slot;
        put_u16(out + 2, frame->result.error);
        put_u32(out + 4, frame->result.clocks);
        put_u32(out + 8, frame->result.first_row_clocks);
        put_u32(out + 12, session_first_missing(session, frame));
    }
    exchange->length = PROTOCOL_STATUS_SIZE;
}

void session_release(session_t *session, exchange_t *exchange)
{
    frame_t *frame = session_find(session, exchange->request->frame_id);

    if (frame != NULL) {
        session_free(session, frame, COUNTER_FRAMES_RELEASED);
    }
}
