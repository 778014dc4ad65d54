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
static uint8_t  answer[PROTOCOL_MESSAGE_MAX];  /* The last reply that is not a part of a map. */
static uint8_t  map[SIZE];                     /* From parts sent without a READ, of the last STREAM. */
static uint32_t parts, streamed_by;            /* Number of them, and their sequence. */
static bool     wire_full;                     /* No part is sent. */

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

static void poll_app(unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        app_poll(&app);
    }
}

/* Payload of the reply to a request, which must not be an error. */
static const uint8_t *ask(uint8_t type, uint32_t frame_id, const void *payload, uint32_t length)
{
    post(type, frame_id, 0, payload, length);
    poll_app(2);
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

/* Sends all pairs from an offset on, and computes the expected map. */
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
    poll_app(30);
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
    poll_app(10);
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
    poll_app(2);
    REQUIRE(answer[HEADER_TYPE] == TYPE_ERROR && get_u16(answer + PROTOCOL_HEADER_SIZE) == ERROR_TYPE);
}

/* A stored frame between two streamed ones is read from memory. */
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
    poll_app(30);
    REQUIRE(stored->state == FRAME_DONE && memcmp(frame_map(stored), map, SIZE) == 0);
    feed(last, 0);
    require_map(last);
}

/* Missing pairs: a timeout five seconds after the last pairs, exact to a poll. */
static void test_no_pairs(void)
{
    frame_t *frame, *next;
    uint64_t begin;

    start();
    frame = stream(1);
    next  = stream(2);
    poll_app(10);
    now  += PAIRS_S - 10000;
    poll_app(1);
    feed(frame, PROTOCOL_CHUNK_SIZE);  /* Pairs at another offset do not count. */
    REQUIRE(frame->state == FRAME_MATCHING);
    post(TYPE_PAIRS, 1, 0, pairs, PROTOCOL_CHUNK_SIZE);
    poll_app(1);
    begin = now;
    now  += PAIRS_S - 10000;
    poll_app(1);
    REQUIRE(frame->state == FRAME_MATCHING && fake_stream_offset() == PROTOCOL_CHUNK_SIZE);
    while (frame->state == FRAME_MATCHING) {
        poll_app(1);
    }
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_TIMEOUT);
    REQUIRE(frame->result.detail > PAIRS_S && now - begin < PAIRS_S + 10000);
    REQUIRE(app.counters.value[COUNTER_FRAMES_FAILED] == 1 && app.stereo.statistics.timeouts == 1);
    /* The next frame is not delayed, and has its full time. */
    poll_app(5);
    REQUIRE(next->state == FRAME_MATCHING);
    feed(next, 0);
    require_map(next);
}

/* After the last pair a frame has the same budget as any other. */
static void test_hanging_matcher(void)
{
    frame_t *frame;

    start();
    frame            = stream(1);
    fake_stereo.hang = true;
    poll_app(5);
    feed(frame, 0);
    poll_app(5);
    now += 100000 + 16 * PIXELS - 10000;
    poll_app(1);
    REQUIRE(frame->state == FRAME_MATCHING);
    now += 10000;
    poll_app(2);
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
    poll_app(5);
    feed(frame, 0);
    poll_app(50);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_MATCHER && frame->result.detail == 2);
    /* Unsent parts are dropped. */
    REQUIRE(fake_stream_status() == 0);
}

/* A release in mid-frame stops the matcher, and no more pairs of the frame are accepted. */
static void test_release(void)
{
    frame_t *frame;

    start();
    frame = stream(1);
    poll_app(5);
    feed(frame, 0);
    poll_app(1);
    feed(stream(2), 0);
    ask(TYPE_RELEASE, 1, NULL, 0);
    poll_app(5);
    frame = stream(2);
    REQUIRE(frame->state == FRAME_MATCHING && fake_stream_offset() == 0);
    post(TYPE_PAIRS, 1, 0, pairs, PROTOCOL_CHUNK_SIZE);
    REQUIRE(fake_stream_offset() == 0);
    feed(frame, 0);
    require_map(frame);
}

/* Unsent parts delay the next frame, but for a second at most; a release drops them at once. */
static void test_full_wire(void)
{
    frame_t *one, *two;

    start();
    one       = stream(1);
    two       = stream(2);
    wire_full = true;
    poll_app(5);
    feed(one, 0);
    poll_app(50);
    REQUIRE(one->state == FRAME_DONE && two->state == FRAME_READY && fake_stream_status() == 2);
    now += 900000;
    poll_app(1);
    REQUIRE(two->state == FRAME_READY);
    now += 100000;
    poll_app(2);
    REQUIRE(two->state == FRAME_MATCHING && fake_stream_status() == 1);
    feed(two, 0);
    poll_app(50);
    REQUIRE(two->state == FRAME_DONE && fake_stream_status() == 2);
    one = stream(3);
    poll_app(5);
    REQUIRE(one->state == FRAME_READY);
    ask(TYPE_RELEASE, 2, NULL, 0);
    poll_app(5);
    REQUIRE(one->state == FRAME_MATCHING && fake_stream_status() == 1);
}

/* Gateware that never finishes a frame costs the frames queued after it, one by one, but not the device. */
static void test_stuck_way(void)
{
    frame_t *one, *two;

    start();
    one       = stream(1);
    two       = stream(2);
    wire_full = true;
    poll_app(5);
    feed(one, 0);
    poll_app(50);
    REQUIRE(one->state == FRAME_DONE && two->state == FRAME_READY);
    fake_frame_link.hang = true;
    poll_app(2);
    now += 1000001;
    poll_app(3);
    REQUIRE(two->state == FRAME_FAILED && two->result.error == ERROR_TIMEOUT);
    fake_frame_link.hang = false;
    wire_full            = false;
    poll_app(5);
    one = stream(3);
    poll_app(5);
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
