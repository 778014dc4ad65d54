/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "serial_link.h"

#include <string.h>

void serial_link_init(serial_link_t *link, session_t *session, counters_t *counters, uint32_t clock_hz)
{
    memset(link, 0, sizeof(*link));
    link->session  = session;
    link->counters = counters;
    link->timeout  = clock_hz;
    cobs_decoder_init(&link->decoder, (uint8_t *)link->message, PROTOCOL_MESSAGE_MAX);
}

static void send(serial_link_t *link, const message_t *reply)
{
    size_t length  = message_build(reply, (uint8_t *)link->reply);
    size_t encoded = cobs_encode((const uint8_t *)link->reply, length, link->framed + 1);

    link->framed[0]           = 0;
    link->framed[1 + encoded] = 0;
    link->write(link->write_context, link->framed, encoded + 2);
}

static void end_frame(serial_link_t *link, uint64_t clock)
{
    static const peer_t line;
    message_t           request;
    message_t           reply;
    status_t            status = cobs_decoder_finish(&link->decoder);

    if (status == STATUS_OK) {
        status = message_parse((const uint8_t *)link->message, link->decoder.length, &request);
    }
    switch (status) {
    case STATUS_OK:
        if (session_handle(link->session, clock, &line, &request, &reply,
                (uint8_t *)link->reply + PROTOCOL_HEADER_SIZE)) {
            send(link, &reply);
        }
        break;
    case STATUS_HEADER:
        count(link->counters, COUNTER_HEADER_ERRORS);
        break;
    case STATUS_CRC:
        count(link->counters, COUNTER_CRC_ERRORS);
        break;
    default:
        count(link->counters, COUNTER_FRAMING_ERRORS);
        break;
    }
}

/* Decodes bytes of a frame; returns their number. */
static size_t receive_frame(serial_link_t *link, uint64_t clock, const uint8_t *bytes, size_t length)
{
    size_t taken = cobs_decode(&link->decoder, bytes, length);

    if (taken == length) {
        return taken;
    }
    /* At a delimiter. Two delimiters in a row are the end of a lost frame and the beginning of the next. */
    if (link->decoder.started) {
        link->in_frame = false;
        end_frame(link, clock);
    }
    return taken + 1;
}

/* Passes on console text up to a delimiter; returns the number of bytes, with the delimiter. */
static size_t receive_text(serial_link_t *link, const uint8_t *bytes, size_t length)
{
    const uint8_t *delimiter = memchr(bytes, 0, length);
    size_t         text      = delimiter != NULL ? (size_t)(delimiter - bytes) : length;

    if (text > 0) {
        link->console(link->console_context, bytes, text);
    }
    if (delimiter == NULL) {
        return text;
    }
    link->in_frame = true;
    cobs_decoder_reset(&link->decoder);
    return text + 1;
}

void serial_link_receive(serial_link_t *link, uint64_t clock, const uint8_t *bytes, size_t length)
{
    link->heard = clock;
    link->counters->value[COUNTER_BYTES_RECEIVED] += (uint32_t)length;
    while (length > 0) {
        size_t taken = link->in_frame ? receive_frame(link, clock, bytes, length) : receive_text(link, bytes, length);

        bytes  += taken;
        length -= taken;
    }
}

void serial_link_poll(serial_link_t *link, uint64_t clock)
{
    if (link->in_frame && clock - link->heard > link->timeout) {
        link->in_frame = false;
        count(link->counters, COUNTER_RECEIVE_TIMEOUTS);
    }
}
