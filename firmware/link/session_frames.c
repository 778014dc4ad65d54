/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

#include "exchange.h"
#include "lib/bytes.h"

void session_open(session_t *session, exchange_t *exchange)
{
    const message_t  *request = exchange->request;
    frame_t          *frame   = session_find(session, request->frame_id);
    stereo_settings_t settings;
    uint8_t           options;

    if (!session_wanted(session, exchange, &settings, &options)) {
        return;
    }
    if (request->frame_id == 0) {
        refuse(exchange, ERROR_FRAME, 0);
        return;
    }
    if (frame == NULL) {
        frame = session_open_new(session, exchange, &settings, options, false);
        if (frame == NULL) {
            return;
        }
    } else if (frame->state != FRAME_LOADING || !session_is_same(frame, &settings, options)) {
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
    const session_transfer_t *transfer = session->transfer;
    frame_t                  *frame    = session_find_or_refuse(session, exchange);

    /* A frame in any state after LOADING has been started: this is a repeated request. */
    if (frame == NULL || frame->state != FRAME_LOADING) {
        return;
    }
    session_refresh(session, frame);
    if (frame->missing != 0) {
        refuse(exchange, ERROR_INCOMPLETE, frame_first_missing(frame));
        return;
    }
    if (session_is_udp(session) && transfer->close_frame(transfer->context, frame) != STATUS_OK) {
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
    if (frame != NULL && frame->options != 0) {
        put_u16(out + 16, frame->result.flags);
        put_u16(out + 18, 0);
        put_u32(out + 20, frame->result.grid_crc);
        exchange->length += PROTOCOL_STATUS_MORE;
    }
}

void session_release(session_t *session, exchange_t *exchange)
{
    frame_t *frame = session_find(session, exchange->request->frame_id);

    if (frame != NULL) {
        session_free(session, frame, COUNTER_FRAMES_RELEASED);
    }
}
