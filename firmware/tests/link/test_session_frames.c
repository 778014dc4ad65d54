/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about frames. */

#include <string.h>

#include "fixture.h"
#include "require.h"

static uint8_t chunk[PROTOCOL_CHUNK_SIZE];

static uint8_t read_map(uint32_t frame_id, uint32_t offset, uint32_t length)
{
    uint8_t payload[4];

    put_u32(payload, length);
    return ask(TYPE_READ, frame_id, offset, payload, 4);
}

static void test_open(void)
{
    set_up();
    hello(1);
    REQUIRE(open_frame(7, 100, 50) == 0x83 && reply.length == 8);
    REQUIRE(get_u16(reply.payload) == 0 && get_u16(reply.payload + 2) == 0 && get_u32(reply.payload + 4) == 5120);
    REQUIRE(open_frame(7, 100, 50) == 0x83 && counters.value[COUNTER_FRAMES_OPENED] == 1);
    open_frame(7, 101, 50);
    require_error(ERROR_DUPLICATE, 7);
    open_frame(7, 100, 51);
    require_error(ERROR_DUPLICATE, 7);
    REQUIRE(open_frame(8, 72, 9) == 0x83 && get_u16(reply.payload) == 1 && get_u32(reply.payload + 4) == 1024);
    open_frame(0, 100, 50);
    require_error(ERROR_FRAME, 0);
}

static void test_open_sizes(void)
{
    set_up();
    hello(1);
    open_frame(1, 641, 9);
    require_error(ERROR_SIZE, SIZE_TOO_WIDE);
    open_frame(1, 100, 481);
    require_error(ERROR_SIZE, SIZE_TOO_HIGH);
    open_frame(1, 640, 480);
    require_error(ERROR_SIZE, SIZE_TOO_LARGE);
    open_frame(1, 71, 9);
    require_error(ERROR_SIZE, SIZE_TOO_NARROW);
    open_frame(1, 0, 9);
    require_error(ERROR_SIZE, SIZE_TOO_NARROW);
    open_frame(1, 72, 8);
    require_error(ERROR_SIZE, SIZE_TOO_LOW);
    open_frame(1, 72, 0);
    require_error(ERROR_SIZE, SIZE_TOO_LOW);
    REQUIRE(counters.value[COUNTER_FRAMES_OPENED] == 0);
}

/* The settings of a frame are those of its OPEN. */
static void test_open_copies_settings(void)
{
    uint8_t  payload[8] = {PARAMETER_BLOCK_SIZE, 0, 0, 0, 15, 0, 0, 0};
    frame_t *frame;

    set_up();
    hello(1);
    open_frame(1, 100, 50);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82);
    open_frame(2, 100, 50);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, 1);
    REQUIRE(frame->settings.block_size == 9 && frame->settings.disparities == 64);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, 2);
    REQUIRE(frame->settings.block_size == 15);
}

/* The reply of each request in each state; repeating a request does no harm. */
static void test_states(void)
{
    for (frame_state_t state = FRAME_LOADING; state <= FRAME_FAILED; state++) {
        frame_t *frame;

        set_up();
        hello(1);
        frame = make_frame(5, state);
        if (state != FRAME_LOADING) {
            open_frame(5, 61, 43);
            require_error(ERROR_DUPLICATE, 5);
            ask(TYPE_UPLOAD, 5, 0, chunk, 1024);
            require_error(ERROR_STATE, state);
            REQUIRE(ask(TYPE_START, 5, 0, NULL, 0) == 0x85 && frame->state == state);
        }
        if (state != FRAME_DONE) {
            read_map(5, 0, 2);
            if (state == FRAME_FAILED) {
                require_error(ERROR_MATCHER, 2);
            } else {
                require_error(ERROR_STATE, state);
            }
        }
        REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.length == 16);
        REQUIRE(reply.payload[0] == state && reply.payload[1] == 0);
        REQUIRE(get_u16(reply.payload + 2) == (state == FRAME_FAILED ? ERROR_MATCHER : 0));
        REQUIRE(get_u32(reply.payload + 4) == (state == FRAME_DONE ? 777u : 0));
        REQUIRE(get_u32(reply.payload + 8) == (state == FRAME_DONE ? 33u : 0));
        REQUIRE(get_u32(reply.payload + 12) == (state == FRAME_LOADING ? 0 : PROTOCOL_NO_OFFSET));
        require_untouched();
        REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88 && frame->state == FRAME_EMPTY);
        REQUIRE(stops == (state == FRAME_MATCHING));
        REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88 && counters.value[COUNTER_FRAMES_RELEASED] == 1);
    }
}

static void test_unknown_frame(void)
{
    set_up();
    hello(1);
    make_frame(5, FRAME_DONE);
    ask(TYPE_UPLOAD, 6, 0, chunk, 1024);
    require_error(ERROR_FRAME, 6);
    ask(TYPE_START, 6, 0, NULL, 0);
    require_error(ERROR_FRAME, 6);
    read_map(6, 0, 1);
    require_error(ERROR_FRAME, 6);
    REQUIRE(ask(TYPE_STATUS, 6, 0, NULL, 0) == 0x86 && reply.payload[0] == 0);
    REQUIRE(get_u32(reply.payload + 12) == PROTOCOL_NO_OFFSET);
    REQUIRE(ask(TYPE_RELEASE, 6, 0, NULL, 0) == 0x88);
}

/* Chunks with a wrong offset or length write nothing, with other frames open. */
static void test_wrong_uploads(void)
{
    frame_t *frame;
    uint32_t pitch = 3072;

    set_up();
    hello(1);
    make_frame(4, FRAME_LOADING);
    frame = make_frame(5, FRAME_LOADING);
    make_frame(6, FRAME_LOADING);
    REQUIRE(frame->pitch == pitch);
    for (uint32_t offset = 0; offset <= 4 * pitch; offset++) {
        uint32_t fits = frame_chunk_length(frame, offset);

        for (uint32_t length = 0; length <= 1024; length += length < 2 || length > 1020 ? 1 : 73) {
            if (length != fits || fits == 0) {
                ask(TYPE_UPLOAD, 5, offset, chunk, length);
                require_error(fits == 0 ? ERROR_OFFSET : ERROR_LENGTH, fits == 0 ? offset : fits);
            }
        }
    }
    for (uint32_t offset = 0xffffffff; offset > 0xffff0000; offset -= 1021) {
        ask(TYPE_UPLOAD, 5, offset, chunk, 1024);
        require_error(ERROR_OFFSET, offset);
    }
    require_untouched();
    REQUIRE(counters.value[COUNTER_CHUNKS_RECEIVED] == 0 && frame->missing == 6);
}

static void test_upload(void)
{
    static const uint32_t offsets[] = {0, 4096, 2048, 5120, 1024, 3072};
    frame_t              *frame;

    set_up();
    hello(1);
    frame = make_frame(5, FRAME_LOADING);
    ask(TYPE_START, 5, 0, NULL, 0);
    require_error(ERROR_INCOMPLETE, 0);
    for (uint32_t i = 0; i < 6; i++) {
        memset(chunk, (int)i + 1, sizeof(chunk));
        for (int again = 0; again < 2; again++) {
            REQUIRE(ask(TYPE_UPLOAD, 5, offsets[i], chunk, frame_chunk_length(frame, offsets[i])) == 0x84);
            REQUIRE(reply.length == 4 && get_u32(reply.payload) == 5 - i);
        }
        REQUIRE(frame->memory[offsets[i]] == i + 1);
    }
    REQUIRE(frame->memory[61 * 43 - 1] == 3 && frame->memory[61 * 43] == CANARY);
    REQUIRE(counters.value[COUNTER_CHUNKS_RECEIVED] == 6 && counters.value[COUNTER_CHUNKS_REPEATED] == 6);
    REQUIRE(counters.value[COUNTER_CHUNKS_WHILE_MATCHING] == 0);
    REQUIRE(ask(TYPE_START, 5, 0, NULL, 0) == 0x85 && frame->state == FRAME_READY);
}

static void test_upload_while_matching(void)
{
    set_up();
    hello(1);
    make_frame(1, FRAME_MATCHING);
    make_frame(2, FRAME_LOADING);
    REQUIRE(ask(TYPE_UPLOAD, 2, 0, chunk, 1024) == 0x84);
    ask(TYPE_START, 2, 0, NULL, 0);
    require_error(ERROR_INCOMPLETE, 1024);
    REQUIRE(counters.value[COUNTER_CHUNKS_WHILE_MATCHING] == 1);
}

static void test_read(void)
{
    uint32_t size = 2 * 61 * 43;
    frame_t *frame;

    set_up();
    hello(1);
    frame = make_frame(5, FRAME_DONE);
    for (uint32_t i = 0; i < size; i++) {
        frame_map(frame)[i] = (uint8_t)(i * 11);
    }
    save_memory();
    for (uint32_t offset = 0; offset < size + 1100; offset += 17) {
        for (uint32_t length = 0; length < 1030; length += length < 3 || length > 1020 ? 1 : 29) {
            uint8_t type = read_map(5, offset, length);

            if (length == 0 || length > 1024) {
                require_error(ERROR_LENGTH, 1024);
            } else if (offset + length > size) {
                require_error(ERROR_OFFSET, offset);
            } else {
                REQUIRE(type == 0x87 && reply.length == length);
                REQUIRE(memcmp(reply.payload, frame_map(frame) + offset, length) == 0);
            }
        }
    }
    read_map(5, 0xffffffff, 1024);
    require_error(ERROR_OFFSET, 0xffffffff);
    read_map(5, 0, 0xffffffff);
    require_error(ERROR_LENGTH, 1024);
    require_untouched();
}

static void test_timeout_is_told(void)
{
    frame_t *frame;

    set_up();
    hello(1);
    frame = make_frame(5, FRAME_MATCHING);
    frame_finish(frame, &(frame_result_t){.error = ERROR_TIMEOUT, .detail = 123456});
    ask(TYPE_STATUS, 5, 0, NULL, 0);
    REQUIRE(reply.payload[0] == FRAME_FAILED && get_u16(reply.payload + 2) == ERROR_TIMEOUT);
    read_map(5, 0, 4);
    require_error(ERROR_TIMEOUT, 123456);
}

int main(void)
{
    test_open();
    test_open_sizes();
    test_open_copies_settings();
    test_states();
    test_unknown_frame();
    test_wrong_uploads();
    test_upload();
    test_upload_while_matching();
    test_read();
    test_timeout_is_told();
    return 0;
}
