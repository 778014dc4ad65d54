/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about chunks of a frame's images, and about parts of its map and of the images that come out. */

#include "exchange.h"
#include "lib/bytes.h"

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
    frame_t         *frame    = session_find_or_refuse(session, exchange);
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

_Static_assert(2 * FRAME_MAX_PIXELS / PROTOCOL_CHUNK_SIZE / 8 <= PROTOCOL_CHUNK_SIZE, "the bits fit a payload");

void session_missing(session_t *session, exchange_t *exchange)
{
    frame_t *frame = session_find_or_refuse(session, exchange);
    uint32_t chunks;

    if (frame == NULL) {
        return;
    }
    session_refresh(session, frame);
    chunks           = frame_chunks(frame);
    exchange->length = (chunks + 7) / 8;
    /* In words, because hosts ask often. What the last word has beyond the length is not sent. */
    for (uint32_t word = 0; word < (chunks + 31) / 32; word++) {
        put_u32(exchange->payload + 4 * word, ~frame->received[word]);
    }
    if (chunks % 8 != 0) {
        exchange->payload[exchange->length - 1] &= (uint8_t)((1u << chunks % 8) - 1);
    }
}

/* Has gateware send the replies to a READ. */
static void queue_read(const session_transfer_t *transfer, exchange_t *exchange, const frame_t *frame, uint32_t length)
{
    exchange->no_reply = transfer->queue_read(transfer->context, exchange->peer, exchange->request, frame, length);
    if (!exchange->no_reply) {
        refuse(exchange, ERROR_BUSY, PROTOCOL_QUEUED_READS);
    }
}

void session_read(session_t *session, exchange_t *exchange)
{
    bool           is_udp = session_is_udp(session);
    uint32_t       offset = exchange->request->offset;
    uint32_t       length = get_u32(exchange->request->payload);
    const frame_t *frame  = session_find_or_refuse(session, exchange);

    if (frame == NULL) {
        return;
    }
    if (frame->state == FRAME_FAILED) {
        refuse(exchange, frame->result.error, frame->result.detail);
    } else if (frame->state != FRAME_DONE) {
        refuse(exchange, ERROR_STATE, frame->state);
    } else if (length == 0 || (!is_udp && length > PROTOCOL_CHUNK_SIZE)) {
        refuse(exchange, ERROR_LENGTH, PROTOCOL_CHUNK_SIZE);
    } else if (!frame_has(frame, offset, length) || (is_udp && offset % PROTOCOL_CHUNK_SIZE != 0)) {
        refuse(exchange, ERROR_OFFSET, offset);
    } else if (is_udp) {
        queue_read(session->transfer, exchange, frame, length);
    } else {
        copy_bytes(exchange->payload, frame_map(frame) + offset, length);
        exchange->length = length;
    }
}
