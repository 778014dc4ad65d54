/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Whose the session is, and for how long. */

#include "exchange.h"

/* Looks for chunks that come past the session, in each second of silence. */
#define LOOKS_PER_SECOND 64u

void session_look(session_t *session, uint64_t clock)
{
    const session_transfer_t *transfer = session->transfer;
    const uint32_t           *value    = session->counters->value;
    uint32_t                  before   = value[COUNTER_CHUNKS_RECEIVED] + value[COUNTER_CHUNKS_REPEATED];

    session->looked = clock;
    if (transfer == NULL) {
        return;
    }
    transfer->count(transfer->context);
    /* What comes past the session is of its peer, and of UDP: nobody else's is taken. */
    if (session->peer.udp && value[COUNTER_CHUNKS_RECEIVED] + value[COUNTER_CHUNKS_REPEATED] != before) {
        session->heard = clock;
    }
}

void session_poll(session_t *session, uint64_t clock)
{
    if (clock - session->looked >= session->info->sys_clk_hz / LOOKS_PER_SECOND) {
        session_look(session, clock);
    }
}

/* Clocks until the session may be taken over; 0 if it may be now. */
static uint64_t time_left(const session_t *session, uint64_t clock)
{
    uint64_t limit  = (uint64_t)PROTOCOL_SILENCE_S * session->info->sys_clk_hz;
    uint64_t silent = clock - session->heard;

    return session->open && silent < limit ? limit - silent : 0;
}

/* Judges a request of another peer than the session's. */
static bool admit_other(session_t *session, exchange_t *exchange)
{
    uint32_t hz = session->info->sys_clk_hz;
    uint64_t left;

    session_look(session, exchange->clock);
    left = time_left(session, exchange->clock);
    if (left > 0) {
        count(session->counters, COUNTER_SESSIONS_REFUSED);
        refuse(exchange, ERROR_BUSY, (uint32_t)((left * 1000 + hz - 1) / hz));
        return false;
    }
    if (exchange->request->type != TYPE_HELLO) {
        refuse(exchange, ERROR_SESSION, 0);
        return false;
    }
    return true;
}

bool session_admit(session_t *session, exchange_t *exchange)
{
    const message_t *request = exchange->request;
    bool             known   = session->token != 0 && request->session == session->token;

    if (!peer_is(&session->peer, exchange->peer)) {
        return admit_other(session, exchange);
    }
    if (request->type == TYPE_HELLO) {
        return true;
    }
    /* A bye that comes again finds its session closed, and is answered all the same. */
    if (!known || (!session->open && request->type != TYPE_BYE)) {
        refuse(exchange, ERROR_SESSION, 0);
        return false;
    }
    return true;
}
