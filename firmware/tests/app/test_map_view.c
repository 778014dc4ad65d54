/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Which maps the screen shows: the newest, complete, each once; no frame is delayed, and no overwritten map is
 * shown. */

#include "app/map_view.h"

#include <string.h>

#include "fake_screen.h"
#include "generated/soc.h"
#include "litestereo/platform.h"
#include "require.h"

/* As large as the screen, so that a picture takes as many polls as possible. */
enum { WIDTH = VIDEO_FRAMEBUFFER_HRES, HEIGHT = VIDEO_FRAMEBUFFER_VRES, SLOTS = 3 };
/* Rows per poll: see map_view.c. */
enum { ROWS_PER_POLL = 640 / WIDTH, POLLS = (HEIGHT + ROWS_PER_POLL - 1) / ROWS_PER_POLL };

static _Alignas(64) uint8_t memory[SLOTS * 65536];
static _Alignas(64) uint8_t pictures[2 * WIDTH * HEIGHT];
static frame_pool_t pool;
static screen_t     screen;
static map_view_t   view;

void memory_to_device(void) {}

static void set_up(void)
{
    fake_screen = (fake_screen_t){0};
    REQUIRE(frame_pool_init(&pool, memory, sizeof(memory), SLOTS) == STATUS_OK);
    REQUIRE(screen_init(&screen, pictures) == STATUS_OK);
    map_view_init(&view, &screen, &pool);
}

static frame_t *open_frame_of(uint32_t id, uint16_t width, uint16_t height)
{
    stereo_settings_t settings = {.width = width, .height = height, .disparities = 16};
    frame_t          *frame;

    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_LINK, id, &settings, &frame) == STATUS_OK);
    return frame;
}

static frame_t *open_frame(uint32_t id, uint16_t width)
{
    return open_frame_of(id, width, HEIGHT);
}

/* Finishes a frame whose pixels all have this grey value; with ERROR_NONE it is DONE. */
static void match(frame_t *frame, uint8_t grey, uint16_t error)
{
    REQUIRE(frame_fill(frame) == STATUS_OK && frame_pool_start(&pool, frame) == STATUS_OK);
    REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    for (uint32_t i = 0; i < frame_pixels(frame); i++) {
        ((int16_t *)(void *)frame_map(frame))[i] = (int16_t)((grey * 240 + 127) / 255);
    }
    REQUIRE(frame_finish(frame, &(frame_result_t){.error = error}) == STATUS_OK);
}

static frame_t *make(uint32_t id, uint8_t grey)
{
    frame_t *frame = open_frame(id, WIDTH);

    match(frame, grey, ERROR_NONE);
    return frame;
}

static void require_shown(uint8_t grey)
{
    for (unsigned row = 0; row < HEIGHT; row++) {
        for (unsigned column = 0; column < WIDTH; column++) {
            REQUIRE(shown_pixel(column, row) == grey);
        }
    }
}

static void poll(unsigned polls)
{
    while (polls-- > 0) {
        map_view_poll(&view);
    }
}

static void test_a_frame(void)
{
    set_up();
    poll(3);
    REQUIRE(fake_screen.shows == 0);
    make(1, 200);
    poll(POLLS - 1);
    REQUIRE(fake_screen.shows == 0);
    require_shown(0);
    poll(1);
    REQUIRE(fake_screen.shows == 1);
    require_shown(200);
    /* Once. */
    poll(3 * POLLS);
    REQUIRE(fake_screen.shows == 1);
}

/* A poll may end before the last row, which is black here: a picture is shown after it, not before. */
static void test_last_row(void)
{
    enum { ROWS = 38 };  /* Of the map: five black rows, which count a quarter, on either side. */

    set_up();
    for (uint8_t grey = 100; grey < 102; grey++) {
        make(grey, grey);
        poll(POLLS);
    }
    REQUIRE(frame_release(frame_pool_find(&pool, FRAME_OWNER_LINK, 100)) == STATUS_OK);
    match(open_frame_of(1, WIDTH, ROWS), 200, ERROR_NONE);
    for (int polls = 0; fake_screen.shows == 2; polls++) {
        REQUIRE(polls < POLLS);
        poll(1);
    }
    for (unsigned row = 0; row < HEIGHT; row++) {
        REQUIRE(shown_pixel(0, row) == (row >= 5 && row < 5 + ROWS ? 200 : 0));
    }
}

static void test_the_newest(void)
{
    set_up();
    make(1, 10);
    make(2, 20);
    make(3, 30);
    poll(1);
    REQUIRE(frame_release(frame_pool_find(&pool, FRAME_OWNER_LINK, 1)) == STATUS_OK);
    make(4, 40);
    /* The map that was begun is finished, then the newest is drawn, and the ones between never. */
    poll(POLLS - 1);
    require_shown(30);
    poll(POLLS);
    require_shown(40);
    poll(3 * POLLS);
    REQUIRE(fake_screen.shows == 2);
    require_shown(40);
}

/* The count of frames wraps around. */
static void test_wrap(void)
{
    set_up();
    pool.next_order = UINT32_MAX - 1;
    map_view_init(&view, &screen, &pool);
    for (uint8_t i = 1; i < 6; i++) {
        frame_t *frame = make(i, i);

        poll(POLLS);
        require_shown(i);
        REQUIRE(frame_release(frame) == STATUS_OK);
    }
    REQUIRE(fake_screen.shows == 5);
}

static void test_failed(void)
{
    set_up();
    match(open_frame(1, WIDTH), 100, ERROR_MATCHER);
    poll(2 * POLLS);
    REQUIRE(fake_screen.shows == 0);
}

/* A released map is still drawn, with its own settings, while the slot gets images of the same size. */
static void test_released(void)
{
    frame_t *frame;

    set_up();
    frame = make(1, 100);
    poll(1);
    REQUIRE(frame_release(frame) == STATUS_OK);
    poll(1);
    REQUIRE(open_frame(2, WIDTH) == frame);
    frame->settings.disparities = 64;
    memset(frame_left(frame), 0xff, 2 * frame->pitch);
    poll(POLLS - 2);
    REQUIRE(fake_screen.shows == 1);
    require_shown(100);
}

/* Not if the matcher may write to it, or if other images overwrite it. */
static void test_gone(void)
{
    frame_t *frame;

    set_up();
    frame = make(1, 100);
    poll(1);
    REQUIRE(frame_release(frame) == STATUS_OK && open_frame(2, WIDTH) == frame);
    REQUIRE(frame_fill(frame) == STATUS_OK && frame_pool_start(&pool, frame) == STATUS_OK);
    poll(2 * POLLS);
    REQUIRE(fake_screen.shows == 0);
    REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    REQUIRE(frame_finish(frame, &(frame_result_t){0}) == STATUS_OK);
    poll(POLLS);
    REQUIRE(fake_screen.shows == 1);

    make(3, 50);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, 3);
    poll(1);
    REQUIRE(frame_release(frame) == STATUS_OK && open_frame(4, 2 * WIDTH) == frame);
    poll(2 * POLLS);
    REQUIRE(fake_screen.shows == 1);
    require_shown(100);
}

static void test_no_screen(void)
{
    set_up();
    screen.width = 0;
    make(1, 100);
    poll(2 * POLLS);
    REQUIRE(fake_screen.shows == 0 && view.frame == NULL);
}

int main(void)
{
    test_a_frame();
    test_last_row();
    test_the_newest();
    test_wrap();
    test_failed();
    test_released();
    test_gone();
    test_no_screen();
    return 0;
}
