/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "udp_link.h"

#include <string.h>

/* Most messages answered by one poll, so that a flood of them does not hold up the main loop. */
#define MOST_ANSWERS 8u

/* The session's transfer. */

static void udp_link_set_session(void *context, uint32_t token, const peer_t *peer)
{
    udp_link_t *link = context;

    (void)frame_link_set_session(link->driver, token, peer);
}

static status_t udp_link_open_frame(void *context, const frame_t *frame)
{
    udp_link_t *link = context;

    return frame_link_open_slot(link->driver, frame->slot, frame->id, frame_left(frame), frame_pixels(frame));
}

static void udp_link_refresh(void *context, frame_t *frame)
{
    udp_link_t *link = context;

    for (uint32_t word = 0; word < (frame_chunks(frame) + 31) / 32; word++) {
        if (frame->received[word] != UINT32_MAX) {
            frame_mark_received(frame, word, frame_link_arrived(link->driver, frame->slot, word));
        }
    }
}

static status_t udp_link_close_frame(void *context, const frame_t *frame)
{
    udp_link_t *link = context;

    return frame_link_close_slot(link->driver, frame->slot);
}

static void udp_link_drop_read(udp_link_t *link, unsigned place)
{
    link->queued--;
    memmove(&link->reads[place], &link->reads[place + 1], (link->queued - place) * sizeof(link->reads[0]));
}

static bool udp_link_queue_read(void *context, const peer_t *peer, const message_t *request, const frame_t *frame,
    uint32_t length)
{
    udp_link_t *link = context;

    if (link->queued == PROTOCOL_QUEUED_READS) {
        return false;
    }
    link->reads[link->queued++] = (udp_read_t){
        .peer  = *peer,
        .slot  = frame->slot,
        .first = {
            .version  = PROTOCOL_VERSION,
            .type     = TYPE_READ | PROTOCOL_REPLY_BIT,
            .session  = request->session,
            .sequence = request->sequence,
            .frame_id = request->frame_id,
            .offset   = request->offset,
            .length   = length,
            .payload  = frame_map(frame) + request->offset,
        },
    };
    return true;
}

static void udp_link_forget_frame(void *context, const frame_t *frame)
{
    udp_link_t *link = context;

    for (unsigned place = link->queued; place-- > 0;) {
        if (link->reads[place].slot != frame->slot) {
            continue;
        }
        if (place == 0 && link->sending) {
            (void)frame_link_abort_burst(link->driver);
            link->sending = false;
        }
        udp_link_drop_read(link, place);
    }
    udp_stream_forget(link, frame);
}

static void udp_link_update_counters(void *context)
{
    udp_link_t           *link   = context;
    uint32_t             *value  = link->counters->value;
    frame_link_counters_t before = link->counted;
    frame_link_counters_t now;

    frame_link_count(link->driver, &now);
    link->counted = now;
    /* Added, not stored: the serial line counts chunks in the same counters. */
    value[COUNTER_DATAGRAMS_RECEIVED]    += now.datagrams_received - before.datagrams_received;
    value[COUNTER_DATAGRAMS_SENT]        += now.datagrams_sent - before.datagrams_sent;
    value[COUNTER_DATAGRAMS_MALFORMED]   += now.datagrams_malformed - before.datagrams_malformed;
    value[COUNTER_DATAGRAMS_OVERRUN]     += now.datagrams_overrun - before.datagrams_overrun;
    value[COUNTER_MAILBOX_OVERRUN]       += now.mailbox_overrun - before.mailbox_overrun;
    value[COUNTER_UPLOADS_FOREIGN]       += now.uploads_foreign - before.uploads_foreign;
    value[COUNTER_UPLOADS_UNFIT]         += now.uploads_unfit - before.uploads_unfit;
    value[COUNTER_CHUNKS_RECEIVED]       += now.chunks_received - before.chunks_received;
    value[COUNTER_CHUNKS_REPEATED]       += now.chunks_repeated - before.chunks_repeated;
    value[COUNTER_CHUNKS_WHILE_MATCHING] += now.chunks_while_matching - before.chunks_while_matching;
}

status_t udp_link_init(udp_link_t *link, frame_link_t *driver, session_t *session, counters_t *counters, uint8_t *payload)
{
    if (driver->capabilities.slots < session->pool->slots) {
        return STATUS_UNSUPPORTED;
    }
    memset(link, 0, sizeof(*link));
    link->driver   = driver;
    link->session  = session;
    link->counters = counters;
    link->payload  = payload;
    link->transfer = (session_transfer_t){
        .context         = link,
        .max_pixels      = driver->capabilities.max_chunks / 2u * PROTOCOL_CHUNK_SIZE,
        .set_session     = udp_link_set_session,
        .open_frame      = udp_link_open_frame,
        .refresh         = udp_link_refresh,
        .close_frame     = udp_link_close_frame,
        .queue_read      = udp_link_queue_read,
        .forget_frame    = udp_link_forget_frame,
        .update_counters = udp_link_update_counters,
    };
    udp_stream_init(link);
    session->transfer = &link->transfer;
    return STATUS_OK;
}

/* The main loop's part. */

/* Drops a READ whose burst is finished, and has gateware send the next one. */
static void udp_link_advance_reads(udp_link_t *link)
{
    if (link->sending && !frame_link_burst_busy(link->driver)) {
        link->sending = false;
        udp_link_drop_read(link, 0);
    }
    if (!link->sending && link->queued > 0) {
        link->sending = frame_link_send_burst(link->driver, &link->reads[0].peer, &link->reads[0].first) == STATUS_OK;
    }
}

static void udp_link_answer(udp_link_t *link, const frame_link_message_t *received, uint64_t clock)
{
    message_t request;
    message_t reply;

    /* Gateware has checked length, magic and CRC, but the message has been in memory since then. */
    switch (message_parse(received->bytes, received->length, &request)) {
    case STATUS_OK:
        if (session_handle(link->session, clock, &received->peer, &request, &reply, link->payload)) {
            (void)frame_link_reply(link->driver, &received->peer, &reply);
        }
        break;
    case STATUS_CRC:
        count(link->counters, COUNTER_CRC_ERRORS);
        break;
    default:
        count(link->counters, COUNTER_HEADER_ERRORS);
        break;
    }
}

void udp_link_poll(udp_link_t *link, uint64_t clock)
{
    frame_link_message_t received;

    udp_link_advance_reads(link);
    for (unsigned answered = 0; answered < MOST_ANSWERS; answered++) {
        /* A request waits until there is room for its reply. */
        if (frame_link_reply_busy(link->driver) || frame_link_peek(link->driver, &received) != STATUS_OK) {
            return;
        }
        udp_link_answer(link, &received, clock);
        frame_link_drop(link->driver);
        udp_link_advance_reads(link);
    }
}
