/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdint.h>
#include <string.h>

#include "link/frame_pool.h"
#include "require.h"

#define CANARY 0xa5
#define GUARD  4096

static uint8_t      memory[GUARD + (1 << 18) + GUARD];
static frame_pool_t pool;

static const stereo_settings_t settings = {.width = 61, .height = 43, .disparities = 16, .block_size = 5};
static const frame_result_t   good     = {.clocks = 1000, .first_row_clocks = 10};
static const frame_result_t   bad      = {.error = ERROR_MATCHER, .detail = 2};

static void set_up(size_t size, unsigned slots)
{
    memset(memory, CANARY, sizeof(memory));
    REQUIRE(frame_pool_init(&pool, memory + GUARD, size, slots) == STATUS_OK);
}

/* A frame in a new pool, brought to a state. */
static frame_t *frame_in(frame_state_t state)
{
    frame_t *frame = &pool.frame[0];

    set_up(1 << 18, 2);
    if (state == FRAME_EMPTY) {
        return frame;
    }
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 7, &settings, &frame) == STATUS_OK);
    REQUIRE(frame->state == FRAME_LOADING && frame->owner == FRAME_OWNER_LINK);
    if (state == FRAME_LOADING) {
        return frame;
    }
    REQUIRE(frame_fill(frame) == STATUS_OK && frame_pool_start(&pool, frame) == STATUS_OK);
    REQUIRE(frame->state == FRAME_READY);
    if (state == FRAME_READY) {
        return frame;
    }
    REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK && frame->state == FRAME_MATCHING);
    if (state != FRAME_MATCHING) {
        REQUIRE(frame_finish(frame, state == FRAME_DONE ? &good : &bad) == STATUS_OK);
    }
    REQUIRE(frame->state == state);
    return frame;
}

/* Chunks marked as received count once; those that the frame does not have, never. */
static void test_note(void)
{
    static const stereo_settings_t sizes[] = {
        {.width = 61, .height = 43}, {.width = 128, .height = 128}, {.width = 130, .height = 130},
        {.width = 4, .height = 1},
    };

    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        frame_t *frame;
        uint32_t chunks;

        set_up(1 << 18, 2);
        REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 7, &sizes[i], &frame) == STATUS_OK);
        chunks = frame_chunks(frame);
        REQUIRE(chunks == 2 * ((frame_pixels(frame) + 1023) / 1024) && frame->missing == chunks);
        frame_mark_received(frame, chunks / 32 + 1, UINT32_MAX);
        frame_mark_received(frame, UINT32_MAX, UINT32_MAX);
        REQUIRE(frame->missing == chunks && frame_first_missing(frame) == 0);
        for (uint32_t chunk = 0; chunk < chunks; chunk++) {
            REQUIRE(frame_first_missing(frame) == chunk * 1024 && frame_pool_start(&pool, frame) == STATUS_INCOMPLETE);
            for (int again = 0; again < 2; again++) {
                frame_mark_received(frame, chunk / 32, 1u << chunk % 32);
                REQUIRE(frame->missing == chunks - chunk - 1);
            }
        }
        for (uint32_t word = 0; word < 256; word++) {
            frame_mark_received(frame, word, UINT32_MAX);
            REQUIRE(frame->received[word] == (32 * word + 32 <= chunks ? UINT32_MAX
                : 32 * word < chunks ? (1u << chunks % 32) - 1 : 0));
        }
        REQUIRE(frame->missing == 0 && frame_first_missing(frame) == PROTOCOL_NO_OFFSET);
    }
    for (frame_state_t state = FRAME_EMPTY; state <= FRAME_FAILED; state++) {
        frame_t *frame = frame_in(state);
        frame_t  before = *frame;

        frame_mark_received(frame, 0, 1);
        REQUIRE((memcmp(frame, &before, sizeof(before)) == 0) == (state != FRAME_LOADING));
    }
}

/* Each operation in each state: its result, and that a refusal changes nothing. */
static void test_transitions(void)
{
    uint8_t chunk[PROTOCOL_CHUNK_SIZE] = {0};
    bool    repeated;

    for (frame_state_t state = FRAME_EMPTY; state <= FRAME_FAILED; state++) {
        status_t loading = state == FRAME_LOADING ? STATUS_OK : STATUS_STATE;
        frame_t *frame   = frame_in(state);

        REQUIRE(frame_write(frame, 0, chunk, sizeof(chunk), &repeated) == loading);
        REQUIRE(frame->state == state);
        REQUIRE(frame_fill(frame) == loading && frame->state == state);
        REQUIRE(frame_pool_start(&pool, frame) == loading);
        REQUIRE(frame->state == (state == FRAME_LOADING ? FRAME_READY : state));

        frame = frame_in(state);
        REQUIRE(frame_pool_begin(&pool, frame)
            == (state == FRAME_MATCHING ? STATUS_BUSY : state == FRAME_READY ? STATUS_OK : STATUS_STATE));
        REQUIRE(frame->state == (state == FRAME_READY ? FRAME_MATCHING : state));

        frame = frame_in(state);
        REQUIRE(frame_finish(frame, &good) == (state == FRAME_MATCHING ? STATUS_OK : STATUS_STATE));
        REQUIRE(frame->state == (state == FRAME_MATCHING ? FRAME_DONE : state));

        frame = frame_in(state);
        REQUIRE(frame_finish(frame, &bad) == (state == FRAME_MATCHING ? STATUS_OK : STATUS_STATE));
        REQUIRE(frame->state == (state == FRAME_MATCHING ? FRAME_FAILED : state));

        frame = frame_in(state);
        REQUIRE(frame_release(frame)
            == (state == FRAME_MATCHING || state == FRAME_EMPTY ? STATUS_STATE : STATUS_OK));
        REQUIRE(frame->state == (state == FRAME_MATCHING ? FRAME_MATCHING : FRAME_EMPTY));
        REQUIRE((frame->owner == FRAME_OWNER_NONE) == (frame->state == FRAME_EMPTY));
    }
    REQUIRE(frame_in(FRAME_DONE)->result.clocks == 1000);
    REQUIRE(frame_in(FRAME_FAILED)->result.detail == 2);
}

static void test_slots_and_owners(void)
{
    frame_t *a, *b, *c;

    set_up(1 << 18, 2);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_NONE, 1, &settings, &a) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 1, &settings, &a) == STATUS_OK && a->slot == 0);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 1, &settings, &c) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_CONSOLE, 1, &settings, &b) == STATUS_OK && b->slot == 1);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 2, &settings, &c) == STATUS_NO_SLOT);
    REQUIRE(frame_pool_find(&pool, FRAME_OWNER_LINK, 1) == a);
    REQUIRE(frame_pool_find(&pool, FRAME_OWNER_CONSOLE, 1) == b);
    REQUIRE(frame_pool_find(&pool, FRAME_OWNER_LINK, 2) == NULL);
    REQUIRE(frame_release(a) == STATUS_OK && frame_pool_find(&pool, FRAME_OWNER_LINK, 1) == NULL);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 2, &settings, &c) == STATUS_OK && c == a);
    REQUIRE(c->missing == 6 && frame_first_missing(c) == 0 && c->result.clocks == 0);
}

static void test_order(void)
{
    frame_t *frame[4];

    set_up(1 << 18, 4);
    pool.next_order = 0xfffffffe;  /* The count wraps around among the four. */
    for (uint32_t id = 0; id < 4; id++) {
        REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, id, &settings, &frame[id]) == STATUS_OK);
        frame_fill(frame[id]);
    }
    REQUIRE(frame_pool_next(&pool) == NULL && frame_pool_matching(&pool) == NULL);
    for (uint32_t i = 0; i < 4; i++) {
        REQUIRE(frame_pool_start(&pool, frame[(i + 2) % 4]) == STATUS_OK);
    }
    for (uint32_t i = 0; i < 4; i++) {
        frame_t *next = frame_pool_next(&pool);

        REQUIRE(next == frame[(i + 2) % 4]);
        REQUIRE(frame_pool_begin(&pool, next) == STATUS_OK && frame_pool_matching(&pool) == next);
        REQUIRE(i == 3 || frame_pool_begin(&pool, frame_pool_next(&pool)) == STATUS_BUSY);
        REQUIRE(frame_finish(next, &good) == STATUS_OK);
    }
    REQUIRE(frame_pool_next(&pool) == NULL);
}

/* Loads a frame of `pixels` in a scrambled order, then checks every byte of the memory. */
static void check_loading(uint32_t width, uint32_t height)
{
    static uint8_t   image[2][1 << 16];
    stereo_settings_t size   = {.width = (uint16_t)width, .height = (uint16_t)height};
    uint32_t         pixels = width * height;
    uint32_t         pitch  = (pixels + 1023) / 1024 * 1024;
    uint32_t         chunks = 2 * pitch / 1024;
    unsigned         random = pixels;
    frame_t         *frame;
    bool             repeated;

    set_up(1 << 18, 2);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 1, &size, &frame) == STATUS_OK);
    REQUIRE(frame->pitch == pitch && frame->missing == chunks);
    for (uint32_t i = 0; i < 2 * pixels; i++) {
        image[i / pixels][i % pixels] = (uint8_t)(next_random(&random) | 1);
    }
    for (uint32_t i = 0; i < 2 * chunks; i++) {
        uint32_t chunk  = (i * 7 + 3) % chunks;
        uint32_t offset = chunk * 1024;
        uint32_t start  = offset % pitch;
        uint32_t length = pixels - start < 1024 ? pixels - start : 1024;
        bool     had    = (frame->received[chunk / 32] >> chunk % 32 & 1) != 0;

        REQUIRE(frame_chunk_length(frame, offset) == length);
        REQUIRE(frame_write(frame, offset, image[offset / pitch] + start, length, &repeated) == STATUS_OK);
        REQUIRE(repeated == had);
    }
    for (uint32_t chunk = 0; chunk < chunks; chunk++) {  /* Those that the stride of seven has skipped. */
        uint32_t start = chunk * 1024 % pitch;

        REQUIRE(frame_write(frame, chunk * 1024, image[chunk * 1024 / pitch] + start,
            frame_chunk_length(frame, chunk * 1024), &repeated) == STATUS_OK);
    }
    REQUIRE(frame->missing == 0 && frame_first_missing(frame) == PROTOCOL_NO_OFFSET);
    REQUIRE(frame_left(frame) == frame->memory && frame_right(frame) == frame->memory + pitch);
    REQUIRE(frame_map(frame) == frame->memory + 2 * pitch && frame_map_size(frame) == 2 * pixels);
    REQUIRE(memcmp(frame_left(frame), image[0], pixels) == 0 && memcmp(frame_right(frame), image[1], pixels) == 0);
    for (uint8_t *byte = memory; byte < memory + sizeof(memory); byte++) {
        bool left  = byte >= frame_left(frame) && byte < frame_left(frame) + pixels;
        bool right = byte >= frame_right(frame) && byte < frame_right(frame) + pixels;

        REQUIRE(left || right || *byte == CANARY);
    }
}

static void test_bad_chunks(void)
{
    static const uint8_t chunk[PROTOCOL_CHUNK_SIZE];
    frame_t             *frame    = frame_in(FRAME_LOADING);
    uint32_t             pixels   = frame_pixels(frame);
    bool                 repeated = false;

    for (uint32_t offset = 0; offset < 3 * frame->pitch; offset++) {
        uint32_t fits = frame_chunk_length(frame, offset);

        for (uint32_t length = 0; length <= 1024; length += length < 8 || length > 1016 ? 1 : 63) {
            status_t status = length == fits && fits > 0 ? STATUS_OK
                : frame_write(frame, offset, chunk, length, &repeated);

            REQUIRE(status == (fits == 0 ? STATUS_OFFSET : length == fits ? STATUS_OK : STATUS_LENGTH));
        }
    }
    REQUIRE(frame_chunk_length(frame, 0) == 1024 && frame_chunk_length(frame, 2048) == pixels - 2048);
    REQUIRE(frame_chunk_length(frame, 2 * frame->pitch) == 0 && frame_chunk_length(frame, 0xfffffc00) == 0);
    REQUIRE(frame->missing == 6 && frame_pool_start(&pool, frame) == STATUS_INCOMPLETE);
    for (uint8_t *byte = memory; byte < memory + sizeof(memory); byte++) {
        REQUIRE(*byte == CANARY);
    }
}

/* The largest frame fits in its slot and leaves its neighbours alone; one pixel more is refused. */
static void test_capacity(void)
{
    for (size_t size = 4 * 4160; size < 4 * 4160 + 40000; size += 61) {
        for (unsigned slots = 1; slots <= 4; slots++) {
            stereo_settings_t most = {.height = 1};
            frame_t         *frame;

            set_up(size, slots);
            most.width = (uint16_t)pool.max_pixels;
            REQUIRE(pool.max_pixels <= UINT16_MAX);
            for (unsigned slot = 0; slot < slots; slot++) {
                size_t room = slot + 1 < slots ? (size_t)(pool.frame[slot + 1].memory - pool.frame[slot].memory)
                    : (size_t)(memory + GUARD + size - pool.frame[slot].memory);

                REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, slot, &most, &frame) == STATUS_OK);
                REQUIRE((uintptr_t)frame->memory % 64 == 0 && frame->memory >= memory + GUARD);
                REQUIRE(2 * frame->pitch + (frame_map_size(frame) + 63) / 64 * 64 <= room);
            }
            REQUIRE(frame_release(&pool.frame[0]) == STATUS_OK);
            most.width++;
            REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 99, &most, &frame) == STATUS_SIZE);
            {
                uint32_t pitch = (pool.max_pixels + 1 + 1023) / 1024 * 1024;
                size_t   slot  = (size - (size_t)(pool.frame[0].memory - memory - GUARD)) / slots / 64 * 64;

                REQUIRE(2 * pitch + (2 * (pool.max_pixels + 1) + 63) / 64 * 64 > slot);
            }
        }
    }
}

/* A streamed frame misses nothing and is queued at once, after earlier ones; only a LOADING frame becomes one. */
static void test_stream(void)
{
    frame_t *stored, *streamed;

    for (frame_state_t state = FRAME_EMPTY; state <= FRAME_FAILED; state++) {
        frame_t *frame = frame_in(state);

        REQUIRE(frame_pool_stream(&pool, frame, 77) == (state == FRAME_LOADING ? STATUS_OK : STATUS_STATE));
        REQUIRE(frame->streamed == (state == FRAME_LOADING));
    }
    stored = frame_in(FRAME_READY);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 8, &settings, &streamed) == STATUS_OK && !streamed->streamed);
    REQUIRE(frame_pool_stream(&pool, streamed, 78) == STATUS_OK && streamed->state == FRAME_READY);
    REQUIRE(streamed->sequence == 78 && streamed->missing == 0);
    REQUIRE(frame_first_missing(streamed) == PROTOCOL_NO_OFFSET && frame_pool_next(&pool) == stored);
    REQUIRE(frame_release(stored) == STATUS_OK && frame_pool_next(&pool) == streamed);
    /* The next frame in its slot is one like any other. */
    REQUIRE(frame_release(streamed) == STATUS_OK);
    for (uint32_t id = 9; id < 11; id++) {
        REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, id, &settings, &stored) == STATUS_OK && !stored->streamed);
    }
}

static void test_bad_arguments(void)
{
    stereo_settings_t empty = {.width = 0, .height = 9};
    frame_t         *frame;

    REQUIRE(frame_pool_init(NULL, memory, 1 << 16, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_init(&pool, NULL, 1 << 16, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_init(&pool, memory, 1 << 16, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_init(&pool, memory, 1 << 16, FRAME_POOL_SLOTS + 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_pool_init(&pool, memory, 2048 + 63, 1) != STATUS_OK);
    REQUIRE(frame_pool_init(&pool, memory, 0, 1) != STATUS_OK);
    /* Memory that ends before its first aligned byte. */
    REQUIRE(frame_pool_init(&pool, pool.frame[0].memory + 1, FRAME_ALIGNMENT - 2, 1) == STATUS_BAD_ARGUMENT);
    set_up(1 << 18, 2);
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 1, &empty, &frame) == STATUS_SIZE);
    empty = (stereo_settings_t){.width = 65535, .height = 65535};
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, 1, &empty, &frame) == STATUS_SIZE);
}

int main(void)
{
    test_note();
    test_transitions();
    test_slots_and_owners();
    test_order();
    check_loading(61, 43);
    check_loading(32, 32);
    check_loading(1, 1);
    check_loading(205, 5);
    check_loading(160, 120);
    test_bad_chunks();
    test_capacity();
    test_stream();
    test_bad_arguments();
    return 0;
}
