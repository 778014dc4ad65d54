/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Streamed frames in the session, with a path that is a few variables. */

#include <string.h>

#include "fixture.h"
#include "require.h"

#define STREAM_REPLY 0x8c

static const peer_t alice = {.udp = true, .address = 0xc0a80164, .port = 5000};

static uint32_t wanted_next;
static unsigned forgotten;

static status_t open_path(void *context, const frame_t *frame)
{
    (void)context;
    (void)frame;
    return STATUS_OK;
}

static uint32_t wanted(void *context)
{
    REQUIRE(context == &wanted_next);
    return wanted_next;
}

static status_t close_path(void *context)
{
    (void)context;
    return STATUS_OK;
}

static frame_stream_t path = {.context = &wanted_next, .open = open_path, .wanted = wanted, .close = close_path};

static void begin(void *context, uint32_t session_token, const peer_t *session_peer)
{
    (void)context;
    (void)session_token;
    (void)session_peer;
}

/* A streamed frame has no chunks to accept, to mark or to wait for. */
static status_t open_slot(void *context, const frame_t *frame)
{
    (void)context;
    REQUIRE(!frame->streamed);
    return STATUS_OK;
}

static void refresh(void *context, frame_t *frame)
{
    (void)context;
    REQUIRE(!frame->streamed);
}

static status_t close_slot(void *context, const frame_t *frame)
{
    (void)context;
    REQUIRE(!frame->streamed);
    return STATUS_OK;
}

static bool read_map(void *context, const peer_t *who, const message_t *asked, const frame_t *frame, uint32_t length)
{
    (void)context;
    REQUIRE(peer_is(who, &alice) && asked->offset + length <= frame_map_size(frame));
    return true;
}

static void forget(void *context, const frame_t *frame)
{
    (void)context;
    forgotten += frame->streamed;
}

static void count_nothing(void *context)
{
    (void)context;
}

static session_transfer_t transfer = {
    .max_pixels = 8192, .stream = &path, .set_session = begin, .open_frame = open_slot, .refresh = refresh,
    .close_frame = close_slot, .queue_read = read_map, .forget_frame = forget, .update_counters = count_nothing,
};

static void greet(uint32_t nonce)
{
    hello(nonce);
    session.settings.disparities = 16;
    session.settings.block_size  = 5;
}

static void start(void)
{
    set_up();
    transfer.stream  = &path;
    session.transfer = &transfer;
    peer             = alice;
    wanted_next      = 0;
    forgotten        = 0;
    greet(1);
}

static uint8_t stream_frame(uint32_t frame_id, uint16_t width, uint16_t height)
{
    uint8_t payload[4];

    put_u16(payload, width);
    put_u16(payload + 2, height);
    return ask(TYPE_STREAM, frame_id, 0, payload, 4);
}

static frame_t *make_stream(uint32_t frame_id)
{
    frame_t *frame;

    REQUIRE(stream_frame(frame_id, 61, 43) == STREAM_REPLY && reply.length == 8);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, frame_id);
    REQUIRE(frame != NULL && get_u16(reply.payload) == frame->slot && get_u16(reply.payload + 2) == 0);
    REQUIRE(get_u32(reply.payload + 4) == 0);
    return frame;
}

static void require_status(uint32_t frame_id, frame_state_t state, uint32_t missing)
{
    REQUIRE(ask(TYPE_STATUS, frame_id, 0, NULL, 0) == 0x86);
    REQUIRE(reply.payload[0] == state && get_u32(reply.payload + 12) == missing);
}

/* The feature depends on the peer's connection, and is not a bit of the matcher's. */
static void test_feature(void)
{
    start();
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_STREAMING) != 0);
    transfer.stream = NULL;
    hello(2);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_STREAMING) == 0);
}

/* Without a path for streamed frames the type is unknown, for every peer. */
static void test_refused_as_type(void)
{
    uint8_t payload[4] = {61, 0, 43, 0};

    start();
    transfer.stream = NULL;
    token++;
    REQUIRE(ask(TYPE_STREAM, 1, 0, payload, 4) == TYPE_ERROR);
    require_error(ERROR_TYPE, TYPE_STREAM);
    set_up();
    session.transfer = &transfer;
    transfer.stream  = &path;
    hello(1);
    REQUIRE(ask(TYPE_STREAM, 1, 0, payload, 4) == TYPE_ERROR);
    require_error(ERROR_TYPE, TYPE_STREAM);
    REQUIRE(ask(TYPE_PAIRS, 1, 0, payload, 4) == TYPE_ERROR);
    require_error(ERROR_TYPE, TYPE_PAIRS);
}

/* Over UDP gateware handles pairs, without an answer. */
static void test_pairs(void)
{
    uint8_t pairs[1024] = {0};

    start();
    make_stream(1);
    save_memory();
    REQUIRE(!request(TYPE_PAIRS, 1, 0, pairs, sizeof(pairs)));
    require_untouched();
}

/* A streamed frame is queued at once, and STATUS tells in every state which pairs are next. */
static void test_life(void)
{
    uint8_t  length[4] = {0, 4, 0, 0};
    frame_t *frame;

    start();
    frame = make_stream(7);
    REQUIRE(frame->streamed && frame->state == FRAME_READY && frame_pool_next(&pool) == frame);
    wanted_next = 2048;  /* Of the frame being matched. */
    require_status(7, FRAME_READY, 0);
    REQUIRE(ask(TYPE_READ, 7, 0, length, 4) == TYPE_ERROR);
    require_error(ERROR_STATE, FRAME_READY);
    REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    wanted_next = 0;
    require_status(7, FRAME_MATCHING, 0);
    wanted_next = 3072;
    require_status(7, FRAME_MATCHING, 3072);
    wanted_next = PROTOCOL_NO_OFFSET;
    require_status(7, FRAME_MATCHING, PROTOCOL_NO_OFFSET);
    frame_finish(frame, &(frame_result_t){.clocks = 777});
    wanted_next = 1024;  /* Of the next one. */
    require_status(7, FRAME_DONE, PROTOCOL_NO_OFFSET);
    REQUIRE(!request(TYPE_READ, 7, 0, length, 4));
    REQUIRE(ask(TYPE_RELEASE, 7, 0, NULL, 0) == 0x88);
    require_status(7, FRAME_EMPTY, PROTOCOL_NO_OFFSET);
    REQUIRE(forgotten == 1 && counters.value[COUNTER_FRAMES_RELEASED] == 1);
    /* The slot is one like any other again. */
    REQUIRE(open_frame(7, 61, 43) == 0x83 && !frame->streamed && frame->state == FRAME_LOADING);
    require_status(7, FRAME_LOADING, 0);
}

/* The frame keeps the settings, and the sequence, of its first STREAM. */
static void test_again(void)
{
    frame_t *frame;
    uint32_t first;

    start();
    frame = make_stream(1);
    first = frame->sequence;
    REQUIRE(first == reply.sequence && frame->settings.disparities == 16);
    session.settings.disparities = 32;
    for (frame_state_t state = FRAME_READY; state <= FRAME_DONE; state++) {
        REQUIRE(make_stream(1) == frame && frame->state == state);
        REQUIRE(frame->sequence == first && frame->settings.disparities == 16);
        REQUIRE(ask(TYPE_START, 1, 0, NULL, 0) == 0x85 && frame->state == state);
        if (state == FRAME_READY) {
            frame_pool_begin(&pool, frame);
        } else if (state == FRAME_MATCHING) {
            frame_finish(frame, &(frame_result_t){0});
        }
    }
    REQUIRE(counters.value[COUNTER_FRAMES_OPENED] == 1);
}

static void test_refusals(void)
{
    start();
    REQUIRE(stream_frame(0, 61, 43) == TYPE_ERROR);
    require_error(ERROR_FRAME, 0);
    REQUIRE(stream_frame(1, 641, 43) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_WIDE);
    REQUIRE(stream_frame(1, 640, 13) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_LARGE);
    REQUIRE(stream_frame(1, 19, 43) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_NARROW);
    REQUIRE(ask(TYPE_STREAM, 1, 0, NULL, 0) == TYPE_ERROR);
    require_error(ERROR_LENGTH, 4);
    make_stream(1);
    REQUIRE(stream_frame(1, 61, 44) == TYPE_ERROR);
    require_error(ERROR_DUPLICATE, 1);
    REQUIRE(stream_frame(1, 62, 43) == TYPE_ERROR);
    require_error(ERROR_DUPLICATE, 1);
    REQUIRE(open_frame(1, 61, 43) == TYPE_ERROR);
    require_error(ERROR_DUPLICATE, 1);
    REQUIRE(open_frame(2, 61, 43) == 0x83);
    REQUIRE(stream_frame(2, 61, 43) == TYPE_ERROR);
    require_error(ERROR_DUPLICATE, 2);
    make_stream(3);
    REQUIRE(stream_frame(4, 61, 43) == TYPE_ERROR);
    require_error(ERROR_NO_SLOT, SLOTS);
}

/* Sends a copy of an earlier STREAM; returns whether it is answered. */
static bool send_copy(uint32_t frame_id, uint32_t sequence)
{
    uint8_t   payload[4] = {61, 0, 43, 0}, room[PROTOCOL_CHUNK_SIZE];
    message_t copy = {
        .version = PROTOCOL_VERSION, .type = TYPE_STREAM, .session = token, .sequence = sequence, .frame_id = frame_id,
        .length = 4, .payload = payload,
    };

    return session_handle(&session, uptime, &peer, &copy, &reply, room);
}

/* A late copy opens no frame, if its frame is one of those that departed last. */
static void test_late_copies(void)
{
    uint32_t departed[SESSION_DEPARTED + 1];

    start();
    for (uint32_t i = 0; i <= SESSION_DEPARTED; i++) {
        departed[i] = make_stream(i + 1)->sequence;
        REQUIRE(send_copy(i + 1, departed[i]));
        REQUIRE(ask(TYPE_RELEASE, i + 1, 0, NULL, 0) == 0x88);
        for (uint32_t j = i < SESSION_DEPARTED ? 0 : 1; j <= i; j++) {
            REQUIRE(!send_copy(j + 1, departed[j]) && frame_pool_next(&pool) == NULL);
        }
    }
    REQUIRE(send_copy(1, departed[0]) && frame_pool_next(&pool) != NULL);
    /* A new session does not remember frames of earlier ones. */
    greet(2);
    REQUIRE(frame_pool_next(&pool) == NULL && send_copy(1, departed[SESSION_DEPARTED]));
    REQUIRE(frame_pool_next(&pool) != NULL);
}

/* Every way to end a frame stops it first, and tells the transfer to forget it. */
static void test_ends(void)
{
    start();
    frame_pool_begin(&pool, make_stream(1));
    make_stream(2);
    REQUIRE(ask(TYPE_RELEASE, 1, 0, NULL, 0) == 0x88 && stops == 1 && forgotten == 1);
    frame_pool_begin(&pool, frame_pool_next(&pool));
    make_stream(3);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a && stops == 2 && forgotten == 3);
    greet(2);
    frame_pool_begin(&pool, make_stream(1));
    greet(3);
    REQUIRE(stops == 3 && forgotten == 4 && counters.value[COUNTER_FRAMES_RECLAIMED] == 1);
}

int main(void)
{
    test_feature();
    test_refused_as_type();
    test_pairs();
    test_life();
    test_again();
    test_refusals();
    test_late_copies();
    test_ends();
    return 0;
}
