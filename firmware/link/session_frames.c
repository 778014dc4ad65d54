/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

#include "exchange.h"
#include "litestereo/bytes.h"

static frame_t *find(session_t *session, uint32_t id)
{
    return frame_pool_find(session->pool, FRAME_OWNER_LINK, id);
}

/* Finds the frame that a request is about, or refuses the request. */
static frame_t *find_or_refuse(session_t *session, exchange_t *exchange)
{
    frame_t *frame = find(session, exchange->request->frame_id);

    if (frame == NULL) {
        refuse(exchange, ERROR_FRAME, exchange->request->frame_id);
    }
    return frame;
}

void session_free(session_t *session, frame_t *frame, enum counter counter)
{
    if (frame->state == FRAME_MATCHING) {
        session->stop(session->context, frame);
    }
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
    if ((uint32_t)settings->width * settings->height > session->pool->max_pixels) {
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

void session_open(session_t *session, exchange_t *exchange)
{
    const message_t  *request  = exchange->request;
    frame_t          *frame    = find(session, request->frame_id);
    stereo_settings_t settings = session->settings;

    settings.width  = get_u16(request->payload);
    settings.height = get_u16(request->payload + 2);
    if (request->frame_id == 0) {
        refuse(exchange, ERROR_FRAME, 0);
        return;
    }
    if (frame == NULL) {
        uint32_t problem = judge_size(session, &settings);

        if (problem != 0) {
            refuse(exchange, ERROR_SIZE, problem);
            return;
        }
        if (frame_pool_open(session->pool, FRAME_OWNER_LINK, request->frame_id, &settings, &frame) != STATUS_OK) {
            refuse(exchange, ERROR_NO_SLOT, session->pool->slots);
            return;
        }
        count(session->counters, COUNTER_FRAMES_OPENED);
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

static void count_chunk(session_t *session, bool repeated)
{
    count(session->counters, repeated ? COUNTER_CHUNKS_REPEATED : COUNTER_CHUNKS_RECEIVED);
    if (frame_pool_matching(session->pool) != NULL) {
        count(session->counters, COUNTER_CHUNKS_WHILE_MATCHING);
    }
}

void session_upload(session_t *session, exchange_t *exchange)
{
    const message_t *request  = exchange->request;
    frame_t         *frame    = find_or_refuse(session, exchange);
    bool             repeated = false;

    if (frame == NULL) {
        return;
    }
    switch (frame_write(frame, request->offset, request->payload, request->length, &repeated)) {
    case STATUS_OK:
        count_chunk(session, repeated);
        put_u32(exchange->payload, frame->missing);
        exchange->length = 4;
        break;
    case STATUS_STATE:
        refuse(exchange, ERROR_STATE, frame->state);
        break;
    case STATUS_LENGTH:
        refuse(exchange, ERROR_LENGTH, frame_chunk_length(frame, request->offset));
        break;
    default:
        refuse(exchange, ERROR_OFFSET, request->offset);
        break;
    }
}

void session_start(session_t *session, exchange_t *exchange)
{
    frame_t *frame = find_or_refuse(session, exchange);

    if (frame == NULL) {
        return;
    }
    /* A frame that is past LOADING has been started, so this is the request once more. */
    if (frame_pool_start(session->pool, frame) == STATUS_INCOMPLETE) {
        refuse(exchange, ERROR_INCOMPLETE, frame_first_missing(frame));
    }
}

void session_status(session_t *session, exchange_t *exchange)
{
    const frame_t *frame = find(session, exchange->request->frame_id);
    uint8_t       *out   = exchange->payload;

    memset(out, 0, PROTOCOL_STATUS_SIZE);
    put_u32(out + 12, PROTOCOL_NO_OFFSET);
    if (frame != NULL) {
        out[0] = (uint8_t)frame->state;
        out[1] = frame->slot;
        put_u16(out + 2, frame->result.error);
        put_u32(out + 4, frame->result.clocks);
        put_u32(out + 8, frame->result.first_row_clocks);
        put_u32(out + 12, frame_first_missing(frame));
    }
    exchange->length = PROTOCOL_STATUS_SIZE;
}

void session_read(session_t *session, exchange_t *exchange)
{
    uint32_t offset = exchange->request->offset;
    uint32_t length = get_u32(exchange->request->payload);
    frame_t *frame  = find_or_refuse(session, exchange);

    if (frame == NULL) {
        return;
    }
    if (frame->state == FRAME_FAILED) {
        refuse(exchange, frame->result.error, frame->result.detail);
    } else if (frame->state != FRAME_DONE) {
        refuse(exchange, ERROR_STATE, frame->state);
    } else if (length == 0 || length > PROTOCOL_CHUNK_SIZE) {
        refuse(exchange, ERROR_LENGTH, PROTOCOL_CHUNK_SIZE);
    } else if (offset >= frame_map_size(frame) || length > frame_map_size(frame) - offset) {
        refuse(exchange, ERROR_OFFSET, offset);
    } else {
        copy_bytes(exchange->payload, frame_map(frame) + offset, length);
        exchange->length = length;
    }
}

void session_release(session_t *session, exchange_t *exchange)
{
    frame_t *frame = find(session, exchange->request->frame_id);

    if (frame != NULL) {
        session_free(session, frame, COUNTER_FRAMES_RELEASED);
    }
}
