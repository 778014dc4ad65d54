/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Streamed frames through the whole firmware: pairs in, parts out, and what goes wrong. */

#include "app_fixture.h"
#include "fake_frame_link.h"
#include "fake_stream.h"
#include "generated/csr.h"
#include "lib/bytes.h"

#define WIDTH    60u
#define HEIGHT   40u
#define PIXELS   (WIDTH * HEIGHT)
#define SIZE     (2 * PIXELS)
#define PARTS    ((SIZE + PROTOCOL_CHUNK_SIZE - 1) / PROTOCOL_CHUNK_SIZE)
#define PAIRS_S  (5u * 1000000u)  /* Clocks. */

static const peer_t alice = {.udp = true, .address = 0xc0a80164, .port = 5000};

static uint32_t token, sequence;
static uint8_t  pairs[SIZE];
static uint8_t  answer[PROTOCOL_MESSAGE_MAX];  /* The last reply that is no part of a map. */
static uint8_t  map[SIZE];                     /* Of parts that came by themselves, of the last STREAM. */
static uint32_t parts, streamed_by;            /* Number of them, and their sequence. */
static bool     wire_full;                     /* No part leaves. */

static bool take(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    message_t message;

    REQUIRE(peer_is(peer, &alice) && message_parse(bytes, length, &message) == STATUS_OK);
    if (message.type != (TYPE_READ | PROTOCOL_REPLY_BIT)) {
        memcpy(answer, bytes, length);
        return true;
    }
    if (wire_full) {
        return false;
    }
    REQUIRE(message.session == token && message.sequence == streamed_by);
    REQUIRE(message.offset % PROTOCOL_CHUNK_SIZE == 0 && message.offset + message.length <= SIZE);
    memcpy(map + message.offset, message.payload, message.length);
    parts++;
    return true;
}

static void post(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length)
{
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX];
    message_t message = {
        .version = PROTOCOL_VERSION, .type = type, .session = token, .sequence = ++sequence, .frame_id = frame_id,
        .offset = offset, .length = length, .payload = payload,
    };

    fake_frame_link_receive(&alice, bytes, message_build(&message, bytes));
}

static void run(unsigned turns)
{
    for (unsigned i = 0; i < turns; i++) {
        app_poll(&app);
    }
}

/* Payload of the reply to a request, which is no error. */
static const uint8_t *ask(uint8_t type, uint32_t frame_id, const void *payload, uint32_t length)
{
    post(type, frame_id, 0, payload, length);
    run(2);
    REQUIRE(answer[HEADER_TYPE] == (type | PROTOCOL_REPLY_BIT) && get_u32(answer + HEADER_SEQUENCE) == sequence);
    return answer + PROTOCOL_HEADER_SIZE;
}

static void start(void)
{
    static const uint8_t parameters[] = {
        PARAMETER_DISPARITIES, 0, 0, 0, 16, 0, 0, 0, PARAMETER_BLOCK_SIZE, 0, 0, 0, 5, 0, 0, 0,
    };
    static const uint8_t nonce[4] = {1};

    fake_frame_link_reset();
    fake_frame_link.version   = FRAME_LINK_VERSION;
    fake_frame_link.streaming = true;
    fake_frame_link.send      = take;
    fake_frame_link.hang      = false;
    wire_full                 = false;
    boot();
    token = 0;
    token = get_u32(ask(TYPE_HELLO, 0, nonce, 4));
    ask(TYPE_CONFIGURE, 0, parameters, sizeof(parameters));
}

static frame_t *stream(uint32_t frame_id)
{
    static const uint8_t size[4] = {WIDTH, 0, HEIGHT, 0};
    frame_t             *frame;

    ask(TYPE_STREAM, frame_id, size, 4);
    frame = frame_pool_find(&app.pool, FRAME_OWNER_LINK, frame_id);
    REQUIRE(frame != NULL && frame->streamed);
    return frame;
}

/* Sends all pairs from an offset on, and makes what the map has to be. */
static void feed(const frame_t *frame, uint32_t from)
{
    streamed_by = frame->sequence;
    parts       = 0;
    memset(map, 0, sizeof(map));
    for (uint32_t i = 0; i < SIZE; i++) {
        pairs[i] = (uint8_t)((i / 2 + (i % 2) * 3) * (i / 2 + (i % 2) * 3) % 251 + frame->id);
    }
    for (uint32_t offset = from; offset < SIZE; offset += PROTOCOL_CHUNK_SIZE) {
        uint32_t rest = SIZE - offset;

        post(TYPE_PAIRS, frame->id, offset, pairs + offset, rest < PROTOCOL_CHUNK_SIZE ? rest : PROTOCOL_CHUNK_SIZE);
    }
}

static void require_map(const frame_t *frame)
{
    run(30);
    REQUIRE(frame->state == FRAME_DONE && frame->result.clocks == PIXELS);
    REQUIRE(parts == PARTS && memcmp(map, frame_map(frame), SIZE) == 0);
}

static void test_frames(void)
{
    frame_t *one, *two;

    start();
    REQUIRE_TYPE("info\r", "streaming: yes\r\n");
    one = stream(1);
    two = stream(2);
    run(10);
    REQUIRE(one->state == FRAME_MATCHING && two->state == FRAME_READY);
    feed(one, 0);
    require_map(one);
    REQUIRE(two->state == FRAME_MATCHING);
    feed(two, 0);
    require_map(two);
    REQUIRE(app.counters.value[COUNTER_FRAMES_MATCHED] == 2 && app.counters.value[COUNTER_FRAMES_FAILED] == 0);
}

static void test_none(void)
{
    static const uint8_t size[4] = {WIDTH, 0, HEIGHT, 0};

    start();
    fake_frame_link.streaming = false;
    boot();
    REQUIRE_TYPE("info\r", "streaming: no\r\n");
    REQUIRE(app.matcher.stream == NULL);
    post(TYPE_STREAM, 1, 0, size, 4);
    run(2);
    REQUIRE(answer[HEADER_TYPE] == TYPE_ERROR && get_u16(answer + PROTOCOL_HEADER_SIZE) == ERROR_TYPE);
}

/* A stored frame between two streamed ones is read from memory, as ever. */
static void test_mixed(void)
{
    frame_t *first, *stored, *last;
    stereo_settings_t settings;

    start();
    first    = stream(1);
    settings = first->settings;
    REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_CONSOLE, 1, &settings, &stored) == STATUS_OK);
    feed(first, 0);
    for (uint32_t i = 0; i < PIXELS; i++) {
        frame_left(stored)[i]  = pairs[2 * i];
        frame_right(stored)[i] = pairs[2 * i + 1];
    }
    REQUIRE(frame_fill(stored) == STATUS_OK && frame_pool_start(&app.pool, stored) == STATUS_OK);
    last = stream(2);
    require_map(first);
    run(30);
    REQUIRE(stored->state == FRAME_DONE && memcmp(frame_map(stored), map, SIZE) == 0);
    feed(last, 0);
    require_map(last);
}

/* Pairs that do not come: five seconds after the last that did, to the clock of the look. */
static void test_no_pairs(void)
{
    frame_t *frame, *next;
    uint64_t begin;

    start();
    frame = stream(1);
    next  = stream(2);
    run(10);
    now  += PAIRS_S - 10000;
    run(1);
    feed(frame, PROTOCOL_CHUNK_SIZE);  /* Pairs that are not wanted are none. */
    REQUIRE(frame->state == FRAME_MATCHING);
    post(TYPE_PAIRS, 1, 0, pairs, PROTOCOL_CHUNK_SIZE);
    run(1);
    begin = now;
    now  += PAIRS_S - 10000;
    run(1);
    REQUIRE(frame->state == FRAME_MATCHING && fake_stream_offset() == PROTOCOL_CHUNK_SIZE);
    while (frame->state == FRAME_MATCHING) {
        run(1);
    }
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_TIMEOUT);
    REQUIRE(frame->result.detail > PAIRS_S && now - begin < PAIRS_S + 10000);
    REQUIRE(app.counters.value[COUNTER_FRAMES_FAILED] == 1 && app.stereo.statistics.timeouts == 1);
    /* The next one is not held up, and has its own time. */
    run(5);
    REQUIRE(next->state == FRAME_MATCHING);
    feed(next, 0);
    require_map(next);
}

/* After the last pair a frame has as long as any other. */
static void test_hanging_matcher(void)
{
    frame_t *frame;

    start();
    frame            = stream(1);
    fake_stereo.hang = true;
    run(5);
    feed(frame, 0);
    run(5);
    now += 100000 + 16 * PIXELS - 10000;
    run(1);
    REQUIRE(frame->state == FRAME_MATCHING);
    now += 10000;
    run(2);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_TIMEOUT);
    REQUIRE(fake_stream_status() == 0);
}

static void test_bus_error(void)
{
    frame_t *frame;

    start();
    frame                 = stream(1);
    fake_stereo.bus_error = true;
    wire_full             = true;
    run(5);
    feed(frame, 0);
    run(50);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_MATCHER && frame->result.detail == 2);
    /* What was not sent is thrown away. */
    REQUIRE(fake_stream_status() == 0);
}

/* A release in mid-frame stops the matcher, and nothing of the frame is taken any more. */
static void test_release(void)
{
    frame_t *frame;

    start();
    frame = stream(1);
    run(5);
    feed(frame, 0);
    run(1);
    feed(stream(2), 0);
    ask(TYPE_RELEASE, 1, NULL, 0);
    run(5);
    frame = stream(2);
    REQUIRE(frame->state == FRAME_MATCHING && fake_stream_offset() == 0);
    post(TYPE_PAIRS, 1, 0, pairs, PROTOCOL_CHUNK_SIZE);
    REQUIRE(fake_stream_offset() == 0);
    feed(frame, 0);
    require_map(frame);
}

/* Parts that do not leave hold the next frame up, but not for more than a second; a release ends them at once. */
static void test_full_wire(void)
{
    frame_t *one, *two;

    start();
    one       = stream(1);
    two       = stream(2);
    wire_full = true;
    run(5);
    feed(one, 0);
    run(50);
    REQUIRE(one->state == FRAME_DONE && two->state == FRAME_READY && fake_stream_status() == 2);
    now += 900000;
    run(1);
    REQUIRE(two->state == FRAME_READY);
    now += 100000;
    run(2);
    REQUIRE(two->state == FRAME_MATCHING && fake_stream_status() == 1);
    feed(two, 0);
    run(50);
    REQUIRE(two->state == FRAME_DONE && fake_stream_status() == 2);
    one = stream(3);
    run(5);
    REQUIRE(one->state == FRAME_READY);
    ask(TYPE_RELEASE, 2, NULL, 0);
    run(5);
    REQUIRE(one->state == FRAME_MATCHING && fake_stream_status() == 1);
}

/* Gateware that never lets go of a frame costs those behind it, one by one, and not the device. */
static void test_stuck_way(void)
{
    frame_t *one, *two;

    start();
    one       = stream(1);
    two       = stream(2);
    wire_full = true;
    run(5);
    feed(one, 0);
    run(50);
    REQUIRE(one->state == FRAME_DONE && two->state == FRAME_READY);
    fake_frame_link.hang = true;
    run(2);
    now += 1000001;
    run(3);
    REQUIRE(two->state == FRAME_FAILED && two->result.error == ERROR_TIMEOUT);
    fake_frame_link.hang = false;
    wire_full            = false;
    run(5);
    one = stream(3);
    run(5);
    feed(one, 0);
    require_map(one);
}

int main(void)
{
    make_memory();
    fake_frame_link.version = 0;
    test_frames();
    test_none();
    test_mixed();
    test_no_pairs();
    test_hanging_matcher();
    test_bus_error();
    test_release();
    test_full_wire();
    test_stuck_way();
    return 0;
}
