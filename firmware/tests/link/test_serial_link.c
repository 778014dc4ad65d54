/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Messages and console text on one line. */

#include <string.h>

#include "fixture.h"
#include "link/serial_link.h"
#include "require.h"

#define SECOND 1000u

static serial_link_t link;
static uint8_t       sent[8192];
static size_t        sent_length;
static char          text[8192];
static size_t        text_length;
static uint8_t       frame[COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2];
static size_t        frame_length;
static uint64_t      now;

static void write_line(void *context, const uint8_t *bytes, size_t length)
{
    REQUIRE(context == sent && sent_length + length <= sizeof(sent));
    memcpy(sent + sent_length, bytes, length);
    sent_length += length;
}

static void type(void *context, const uint8_t *bytes, size_t length)
{
    REQUIRE(context == text && length > 0 && memchr(bytes, 0, length) == NULL);
    REQUIRE(text_length + length < sizeof(text));
    memcpy(text + text_length, bytes, length);
    text_length += length;
    text[text_length] = 0;
}

/* A framed request for the status of frame 1, in `frame`. */
static void make(void)
{
    uint8_t   buffer[PROTOCOL_MESSAGE_MAX];
    message_t request = {.version = 1, .type = TYPE_STATUS, .session = token, .sequence = 0x01010101, .frame_id = 1};

    frame[0]     = 0;
    frame_length = 1 + cobs_encode(buffer, message_build(&request, buffer), frame + 1);
    frame[frame_length++] = 0;
}

static void start(void)
{
    set_up();
    hello(1);
    memset(&counters, 0, sizeof(counters));
    serial_link_init(&link, &session, &counters, SECOND);
    link.write           = write_line;
    link.write_context   = sent;
    link.console         = type;
    link.console_context = text;
    sent_length = text_length = 0;
    text[0] = 0;
    now     = 0;
    make();
}

static void receive(const void *bytes, size_t length)
{
    serial_link_receive(&link, now, bytes, length);
}

static void receive_text(const char *bytes)
{
    receive(bytes, strlen(bytes));
}

/* Replies on the line since the last call. */
static unsigned replies(void)
{
    uint8_t        buffer[PROTOCOL_MESSAGE_MAX];
    cobs_decoder_t decoder;
    unsigned       number = 0;
    message_t      message;

    for (size_t at = 0; at < sent_length; number++) {
        REQUIRE(sent[at++] == 0);
        cobs_decoder_init(&decoder, buffer, sizeof(buffer));
        at += cobs_decode(&decoder, sent + at, sent_length - at);
        REQUIRE(at < sent_length && sent[at++] == 0);
        REQUIRE(cobs_decoder_finish(&decoder) == STATUS_OK);
        REQUIRE(message_parse(buffer, decoder.length, &message) == STATUS_OK && message.type == 0x86);
    }
    sent_length = 0;
    return number;
}

static void test_text_and_frames(void)
{
    start();
    receive_text("he");
    receive(frame, frame_length);
    REQUIRE(replies() == 1);
    receive_text("lp\r");
    receive(frame, frame_length);
    receive(frame, frame_length);
    REQUIRE(replies() == 2 && strcmp(text, "help\r") == 0 && !link.in_frame);
    REQUIRE(counters.value[COUNTER_BYTES_RECEIVED] == 5 + 3 * frame_length);
}

static void test_any_pieces(void)
{
    uint8_t stream[600];
    size_t  length = 1;

    for (size_t piece = 1; piece <= length; piece++) {
        start();
        length = 0;
        for (int i = 0; i < 3; i++) {
            memcpy(stream + length, "hi", 2);
            memcpy(stream + length + 2, frame, frame_length);
            length += 2 + frame_length;
        }
        for (size_t at = 0; at < length; at += piece) {
            receive(stream + at, length - at < piece ? length - at : piece);
        }
        REQUIRE(replies() == 3 && strcmp(text, "hihihi") == 0);
    }
}

/* A delimiter too few or too many, at either side, costs at most one message. */
static void test_delimiters(void)
{
    start();
    receive(frame + 1, frame_length - 1);
    receive(frame, frame_length);
    REQUIRE(replies() == 1 && text_length == frame_length - 2);
    receive(frame, frame_length);
    REQUIRE(replies() == 1);

    start();
    receive(frame, frame_length - 1);
    receive(frame, frame_length);
    receive(frame, frame_length);
    REQUIRE(replies() == 2);

    start();
    receive("\0", 1);
    receive(frame, frame_length);
    receive("\0\0\0", 3);
    receive(frame, frame_length);
    REQUIRE(replies() == 2 && text_length == 0 && counters.value[COUNTER_FRAMING_ERRORS] == 0);

    /* After a stray delimiter text counts as a frame, up to the next delimiter. */
    start();
    receive("he\0lp\r", 6);
    receive(frame, frame_length);
    receive(frame, frame_length);
    REQUIRE(replies() == 1 && counters.value[COUNTER_FRAMING_ERRORS] == 1);
}

static void test_bad_frames(void)
{
    uint8_t flood[5000];

    start();
    memset(flood, 'x', sizeof(flood));
    receive("\0", 1);
    receive(flood, sizeof(flood));
    receive("\0", 1);
    REQUIRE(counters.value[COUNTER_FRAMING_ERRORS] == 1 && replies() == 0 && !link.in_frame);
    receive("\0\1\1\1\1\0", 6);
    REQUIRE(counters.value[COUNTER_FRAMING_ERRORS] == 2);
    frame[10] ^= 0x10;  /* In the sequence number. */
    receive(frame, frame_length);
    REQUIRE(counters.value[COUNTER_CRC_ERRORS] == 1);
    make();
    frame[2] ^= 0x10;  /* In the magic. */
    receive(frame, frame_length);
    REQUIRE(counters.value[COUNTER_HEADER_ERRORS] == 1 && replies() == 0 && text_length == 0);
    make();
    receive(frame, frame_length);
    REQUIRE(replies() == 1);
}

static void test_timeout(void)
{
    start();
    receive(frame, 10);
    now = SECOND;
    serial_link_poll(&link, now);
    REQUIRE(link.in_frame);
    receive(frame + 10, 2);
    now = 2 * SECOND;
    serial_link_poll(&link, now);
    REQUIRE(link.in_frame && counters.value[COUNTER_RECEIVE_TIMEOUTS] == 0);
    now++;
    serial_link_poll(&link, now);
    serial_link_poll(&link, now);
    REQUIRE(!link.in_frame && counters.value[COUNTER_RECEIVE_TIMEOUTS] == 1);
    receive_text("info\r");
    REQUIRE(strcmp(text, "info\r") == 0);
    receive(frame, frame_length);
    REQUIRE(replies() == 1);
    now += 10 * SECOND;
    serial_link_poll(&link, now);
    REQUIRE(counters.value[COUNTER_RECEIVE_TIMEOUTS] == 1);
}

/* An echo of our own reply is not answered. */
static void test_echo(void)
{
    uint8_t echo[256];
    size_t  length;

    start();
    receive(frame, frame_length);
    length = sent_length;
    memcpy(echo, sent, length);
    REQUIRE(replies() == 1);
    receive(echo, length);
    REQUIRE(replies() == 0 && counters.value[COUNTER_HEADER_ERRORS] == 1);
}

int main(void)
{
    test_text_and_frames();
    test_any_pieces();
    test_delimiters();
    test_bad_frames();
    test_timeout();
    test_echo();
    return 0;
}
