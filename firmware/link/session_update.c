/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests that replace the device's firmware, and that restart it. */

#include <string.h>

#include "exchange.h"
#include "lib/bytes.h"

static void put_progress(const update_t *update, exchange_t *exchange)
{
    uint8_t *out = exchange->payload;

    memset(out, 0, PROTOCOL_PROGRESS_SIZE);
    out[0] = (uint8_t)update->state;
    out[1] = (uint8_t)update->failure;
    out[2] = (uint8_t)update_trial(update);
    put_u32(out + 4, update->done);
    put_u32(out + 8, update->total);
    put_u32(out + 12, update_room(update));
    exchange->length = PROTOCOL_PROGRESS_SIZE;
}

void session_update(session_t *session, exchange_t *exchange)
{
    update_t      *update  = session->update;
    const uint8_t *payload = exchange->request->payload;

    switch (update_begin(update, get_u32(payload), get_u32(payload + 4))) {
    case STATUS_OK:
        put_progress(update, exchange);
        break;
    case STATUS_SIZE:
        refuse(exchange, ERROR_SIZE, SIZE_TOO_LONG);
        break;
    default:
        refuse(exchange, ERROR_STATE, update->state);
        break;
    }
}

void session_image(session_t *session, exchange_t *exchange)
{
    const message_t *request = exchange->request;
    update_t        *update  = session->update;

    switch (update_store(update, request->offset, request->payload, request->length)) {
    case STATUS_OK:
        break;
    case STATUS_STATE:
        refuse(exchange, ERROR_STATE, update->state);
        break;
    case STATUS_LENGTH:
        refuse(exchange, ERROR_LENGTH, update_chunk_length(update, request->offset));
        break;
    default:
        refuse(exchange, ERROR_OFFSET, request->offset);
        break;
    }
}

static bool is_calibrating(const session_t *session)
{
    return session->calibrate != NULL && calibrate_is_running(session->calibrate);
}

void session_write(session_t *session, exchange_t *exchange)
{
    /* One of them at a time uses the flash. */
    if (is_calibrating(session)) {
        refuse(exchange, ERROR_STATE, session->update->state);
        return;
    }
    if (update_write(session->update) != STATUS_OK) {
        refuse(exchange, ERROR_STATE, session->update->state);
        return;
    }
    put_progress(session->update, exchange);
}

void session_progress(session_t *session, exchange_t *exchange)
{
    put_progress(session->update, exchange);
}

void session_restart(session_t *session, exchange_t *exchange)
{
    if (session->update != NULL && update_is_running(session->update)) {
        refuse(exchange, ERROR_STATE, session->update->state);
        return;
    }
    if (is_calibrating(session)) {
        refuse(exchange, ERROR_STATE, session->calibrate->state);
        return;
    }
    if (!session->restarting) {
        session->restarting = true;
        session->restart_at = exchange->clock + (uint64_t)session->info->sys_clk_hz * RESTART_DELAY_MS / 1000;
    }
}

bool session_wants_restart(const session_t *session, uint64_t clock)
{
    return session->restarting && (int64_t)(clock - session->restart_at) >= 0;
}
