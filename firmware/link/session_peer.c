/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Which host the session belongs to, and for how long; which hosts get an answer. */

#include "exchange.h"

/* Updates of the counters per second by session_poll. */
#define UPDATES_PER_SECOND 64u

void session_update_counters(session_t *session, uint64_t clock)
{
    const session_transfer_t *transfer = session->transfer;
    const uint32_t           *value    = session->counters->value;
    uint32_t                  before   = value[COUNTER_CHUNKS_RECEIVED] + value[COUNTER_CHUNKS_REPEATED];

    session->counters_updated = clock;
    if (transfer == NULL) {
        return;
    }
    transfer->update_counters(transfer->context);
    /* Gateware accepts chunks of the session's peer only, so they are a sign of life. */
    if (session->peer.udp && value[COUNTER_CHUNKS_RECEIVED] + value[COUNTER_CHUNKS_REPEATED] != before) {
        session->heard = clock;
    }
}

void session_poll(session_t *session, uint64_t clock)
{
    if (clock - session->counters_updated >= session->info->sys_clk_hz / UPDATES_PER_SECOND) {
        session_update_counters(session, clock);
    }
}

/* Clocks until another host may take over the session; 0 if it may do so now. */
static uint64_t clocks_to_takeover(const session_t *session, uint64_t clock)
{
    uint64_t limit  = (uint64_t)PROTOCOL_SILENCE_S * session->info->sys_clk_hz;
    uint64_t silent = clock - session->heard;

    return session->open && silent < limit ? limit - silent : 0;
}

/* Admits a HELLO of another peer once the session is closed or silent; refuses everything else. */
static bool admit_other(session_t *session, exchange_t *exchange)
{
    uint32_t hz = session->info->sys_clk_hz;
    uint64_t wait;

    session_update_counters(session, exchange->clock);
    wait = clocks_to_takeover(session, exchange->clock);
    if (wait > 0) {
        count(session->counters, COUNTER_SESSIONS_REFUSED);
        refuse(exchange, ERROR_BUSY, (uint32_t)((wait * 1000 + hz - 1) / hz));
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
    /* A repeated BYE finds its session closed, and is answered all the same. */
    if (!known || (!session->open && request->type != TYPE_BYE)) {
        refuse(exchange, ERROR_SESSION, 0);
        return false;
    }
    return true;
}

/* Whether a request that has been handled is of the session's host, and carries its token. */
static bool is_own(const session_t *session, const exchange_t *exchange)
{
    const message_t *request = exchange->request;

    return peer_is(&session->peer, exchange->peer)
        && (request->type == TYPE_HELLO || (session->token != 0 && request->session == session->token));
}

bool session_may_answer(session_t *session, const exchange_t *exchange)
{
    uint64_t step = session->info->sys_clk_hz / SESSION_STRANGER_RATE;

    /* The line has one peer, and its bytes stay on it. */
    if (!exchange->peer->udp || is_own(session, exchange)) {
        return true;
    }
    if (session->strangers_served < exchange->clock) {
        session->strangers_served = exchange->clock;
    }
    if (session->strangers_served - exchange->clock > (SESSION_STRANGER_BURST - 1) * step) {
        return false;
    }
    session->strangers_served += step;
    return true;
}

void session_remember_hello(session_t *session)
{
    if (session->token != 0) {
        session->hellos[session->hello_count++ % SESSION_HELLOS] = (session_hello_t){
            .peer = session->peer, .nonce = session->nonce,
        };
    }
}

bool session_has_said_hello(const session_t *session, const peer_t *peer, uint32_t nonce)
{
    /* A serial line delivers in order: what arrives there is no late copy. */
    for (uint32_t i = 0; peer->udp && i < SESSION_HELLOS && i < session->hello_count; i++) {
        if (session->hellos[i].nonce == nonce && peer_is(&session->hellos[i].peer, peer)) {
            return true;
        }
    }
    return false;
}
