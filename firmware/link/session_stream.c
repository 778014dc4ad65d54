/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about streamed frames, whose pixels and maps gateware moves. */

#include "exchange.h"
#include "lib/bytes.h"

void session_stream(session_t *session, exchange_t *exchange)
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
        /* A late copy: its frame would never get pixels, and would hold up all frames after it. */
        if (session_has_departed(session, request->sequence)) {
            exchange->no_reply = true;
            return;
        }
        frame = session_open_new(session, exchange, &settings, options, true);
        if (frame == NULL) {
            return;
        }
    } else if (!frame->streamed || !session_is_same(frame, &settings, options)) {
        refuse(exchange, ERROR_DUPLICATE, request->frame_id);
        return;
    }
    put_u16(exchange->payload, frame->slot);
    put_u16(exchange->payload + 2, 0);
    put_u32(exchange->payload + 4, 0);
    exchange->length = 8;
}
