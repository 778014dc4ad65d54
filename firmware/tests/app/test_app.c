/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The console, frames in the matcher, and faults. */

#include "app_fixture.h"
#include "fake_screen.h"
#include "generated/csr.h"
#include "litestereo/ensure.h"

static void test_console(void)
{
    boot();
    REQUIRE(strstr(out, "LiteStereo on test") != NULL && strstr(out, "litestereo> ") != NULL);
    REQUIRE_TYPE("help\r", "bench WIDTH HEIGHT DISPARITIES BLOCK_SIZE sad|all");
    REQUIRE_TYPE("info\n", "disparities: 16 to 64\r\n");
    REQUIRE_TYPE("info\n", "features: xsobel raw texture uniqueness subpixel left_right min_disparity median\r\n");
    REQUIRE(strcmp(type("\r"), "\r\nlitestereo> ") == 0);
    REQUIRE(strcmp(type("\n"), "") == 0);
    REQUIRE(strcmp(type("x\b"), "x\b \b") == 0);
    REQUIRE_TYPE("  stats  \r", "console_lines: 4\r\n");
    REQUIRE_TYPE("hlep\r", "unknown command");
    REQUIRE_TYPE("help me\r", "usage: help\r\n");
    REQUIRE_TYPE("help 1 2 3 4 5 6 7 8 9 10 11 12\r", "usage: help\r\n");
    /* No user typed this, so there is no answer. */
    REQUIRE(strcmp(type("\x01\xff help\r"), "") == 0);
    REQUIRE_TYPE("help\r", "selftest");
    for (int i = 0; i < 200; i++) {
        type("a");
    }
    REQUIRE(strcmp(type("\r"), "") == 0);
    REQUIRE_TYPE("info\r", "clock: 1000000 Hz");
    REQUIRE_TYPE("info\r", "stack: 1000 of 4096 bytes used so far\r\n");
}

static void test_bench(void)
{
    static const char *const wrong[] = {
        "bench\r", "bench 64 32 16 5\r", "bench 64 32 16 5 sad 1\r", "bench 64 32 16 x sad\r",
        "bench -64 32 16 5 sad\r", "bench 64 32 16 5x sad\r", "bench 0 32 16 5 sad\r", "bench 65600 32 16 5 sad\r",
        "bench 64 32 16 261 sad\r", "bench 64 32 16 5 some\r", "bench 64 0 16 5 sad\r", "bench 64 32 0 5 sad\r",
        "bench 64 32 16 0 sad\r",
    };
    stereo_settings_t settings = {.width = 20, .height = 20};
    frame_t          *frame[FRAME_POOL_SLOTS];

    boot();
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        REQUIRE_TYPE(wrong[i], "usage: bench");
    }
    REQUIRE_TYPE("bench 64 32 20 5 sad\r", "bench: refused: bad disparities\r\n");
    REQUIRE_TYPE("bench 64 32 16 6 sad\r", "bench: refused: bad block_size\r\n");
    REQUIRE_TYPE("bench 19 32 16 5 sad\r", "bench: refused: bad width\r\n");
    REQUIRE_TYPE("bench 64 4 16 5 sad\r", "bench: refused: bad height\r\n");
    REQUIRE_TYPE("bench 640 480 16 5 sad\r", "bench: refused: a slot holds at most");
    REQUIRE_TYPE("bench 61 33 16 5 sad\r",
        "bench: width=61 height=33 disparities=16 block_size=5 clocks=2013 first_row_clocks=183 crc32=0x");
    REQUIRE_TYPE("bench 60 33 16 5 all\r", "clocks=1980 first_row_clocks=180 crc32=0x");
    REQUIRE_TYPE("cpu_bench 61 33 16 5 sad\r", "cpu_bench: width=61 height=33 disparities=16 block_size=5 clocks=");
    REQUIRE_TYPE("cpu_bench 700 9 64 5 sad\r", "cpu_bench: refused: bad width, the CPU has too little memory\r\n");
    REQUIRE_TYPE("cpu_bench 61 33 16 5\r", "usage: cpu_bench");
    for (uint32_t i = 0; i < FRAME_POOL_SLOTS; i++) {
        REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_LINK, i, &settings, &frame[i]) == STATUS_OK);
    }
    REQUIRE_TYPE("bench 64 32 16 5 sad\r", "bench: refused: no slot is free\r\n");
    REQUIRE_TYPE("selftest\r", "selftest: refused: no slot is free\r\n");
}

/* Frames are matched one at a time, in the order of their starts, and each gets its own map. */
static void test_matcher(void)
{
    frame_t *frame[3];

    boot();
    for (uint32_t i = 0; i < 3; i++) {
        frame[i] = load_frame(i);
    }
    for (uint32_t i = 0; i < 3; i++) {
        app_poll(&app);
        for (int polls = 0; frame[i]->state == FRAME_MATCHING; polls++) {
            REQUIRE(polls < 100 && (i == 2 || frame[i + 1]->state == FRAME_READY));
            app_poll(&app);
        }
        REQUIRE(frame[i]->state == FRAME_DONE && frame[i]->result.clocks == 800);
        REQUIRE(frame_map(frame[i])[0] == 0xf0 && frame_map(frame[i])[1] == 0xff);
    }
    REQUIRE(app.counters.value[COUNTER_FRAMES_MATCHED] == 3 && app.counters.value[COUNTER_FRAMES_FAILED] == 0);
    REQUIRE(app.counters.value[COUNTER_MATCHER_INTERRUPTS] == 3);
}

/* A map that is done is shown in the middle of the screen, with black around it. */
static void test_screen(void)
{
    frame_t *frame;

    boot();
    REQUIRE(shown_pixel(0, 0) == 0 && shown_pixel(63, 47) == 0);
    frame = load_frame(1);
    while (frame->state != FRAME_DONE) {
        app_poll(&app);
    }
    /* The fake accelerator finds no disparities. The last row is not drawn by this poll. */
    ((int16_t *)(void *)frame_map(frame))[40 * 19 + 39] = 240;
    for (int polls = 0; fake_screen.shows == 0; polls++) {
        REQUIRE(polls < 10);
        app_poll(&app);
    }
    REQUIRE(shown_pixel(51, 33) == 255 && shown_pixel(51, 32) == 0 && shown_pixel(52, 33) == 0);
}

/* A frame that lacks pixels is neither matched nor waited for; nor is a streamed one without a path. */
static void test_no_match(void)
{
    stereo_settings_t settings = {.width = 40, .height = 20, .disparities = 16, .block_size = 5};
    frame_t          *frame;

    boot();
    REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_CONSOLE, 1, &settings, &frame) == STATUS_OK);
    REQUIRE(matcher_run(&app.matcher, frame) == FRAME_LOADING && app.counters.value[COUNTER_FRAMES_FAILED] == 0);
    REQUIRE(app.matcher.stream == NULL && frame_pool_stream(&app.pool, frame, 1) == STATUS_OK);
    app_poll(&app);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_MATCHER);
    REQUIRE(frame->result.detail == STEREO_ERROR_CONFIG && app.counters.value[COUNTER_FRAMES_FAILED] == 1);
}

/* A stopped match writes nothing more, and does not delay the next one. */
static void test_stop(void)
{
    frame_t *frame, *next;

    boot();
    frame = load_frame(1);
    next  = load_frame(2);
    app_poll(&app);
    REQUIRE(frame->state == FRAME_MATCHING);
    matcher_stop(&app.matcher, frame);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.detail == STEREO_ERROR_ABORTED);
    REQUIRE((stereo_status_read() & 1) == 0);
    for (int polls = 0; polls < 100; polls++) {
        app_poll(&app);
    }
    REQUIRE(frame_map(frame)[0] == 0 && next->state == FRAME_DONE);
}

/* Settings that the gateware refuses fail the frame, not the device. */
static void test_refused_settings(void)
{
    frame_t *frame;

    boot();
    frame = load_frame(1);
    frame->settings.block_size = 6;
    app_poll(&app);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_MATCHER);
    REQUIRE(frame->result.detail == STEREO_ERROR_CONFIG);
}

/* An accelerator that does not stop costs bounded waits and a reset, and works again once it stops. */
static void test_stuck(void)
{
    frame_t *frame, *next;

    boot();
    fake_stereo.hang = fake_stereo.stuck = true;
    frame = load_frame(1);
    next  = load_frame(2);
    for (int polls = 0; polls < 10000; polls++) {
        app_poll(&app);
    }
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_TIMEOUT && frame->result.detail > 100000);
    REQUIRE(next->state == FRAME_FAILED && next->result.error == ERROR_TIMEOUT && next->result.detail == 0);
    REQUIRE(resets == 1 && last_reset == RESET_MATCHER);
    fake_stereo.hang = fake_stereo.stuck = false;
    fake_stereo_advance();
    REQUIRE_TYPE("selftest\r", "selftest: passed");
}

/* One that stops at the second attempt costs the frame, but no reset. */
static void test_stops_late(void)
{
    frame_t *frame, *next;

    boot();
    fake_stereo.hang = true;
    frame = load_frame(1);
    next  = load_frame(2);
    for (int polls = 0; frame->state != FRAME_FAILED; polls++) {
        REQUIRE(polls < 10000);
        /* More aborts than one attempt makes, fewer than two attempts make. */
        fake_stereo.deaf = 1200;
        app_poll(&app);
    }
    REQUIRE(frame->result.error == ERROR_TIMEOUT && app.stereo.statistics.stuck == 1 && app.stuck == 1);
    REQUIRE(fake_stereo.deaf == 0 && resets == 0);
    fake_stereo.hang = false;
    app_poll(&app);
    REQUIRE(next->state == FRAME_FAILED && next->result.error == ERROR_TIMEOUT);
    REQUIRE_TYPE("selftest\r", "selftest: passed");
}

/* The self-test does not pass for a matcher that is too small for all cases, nor if no frame fits in memory. */
static void test_small_devices(void)
{
    fake_stereo.max_width = 19;
    boot();
    REQUIRE_TYPE("selftest\r", "selftest: FAILED: the device takes none of the cases\r\n");
    fake_stereo.max_width = 1024;
    frame_memory          = FRAME_POOL_SLOTS * 4096 + screen_bytes();
    boot();
    REQUIRE_TYPE("selftest\r", "selftest: passed, 3 frames, ");
    frame_memory = FRAME_POOL_SLOTS * 2048;
    type("");
    REQUIRE(app_init(&app, &app_buffers) == STATUS_SIZE && strstr(out, "8192 bytes of memory are too few for frames.") != NULL);
    /* Frames have priority over the screen. */
    REQUIRE(app.screen.width == 0);
    frame_memory = 1 << 20;
}

static void test_faults(void)
{
    boot();
    REQUIRE_TYPE("selftest\r", "selftest: passed, 4 frames");
    fake_stereo.bus_error = true;
    REQUIRE_TYPE("bench 64 32 16 5 sad\r", "bench: FAILED: the matcher ended with error 2\r\n");
    REQUIRE_TYPE("selftest\r", "selftest: FAILED: the matcher ended with error 2\r\n");
    fake_stereo.bus_error = false;
    fake_stereo.hang      = true;
    REQUIRE_TYPE("bench 64 32 16 5 sad\r", "bench: FAILED: the matcher did not finish in");
    REQUIRE_TYPE("stats\r", "matcher_timeouts: 1\r\n");
    REQUIRE_TYPE("stats\r", "frames_failed: 3\r\n");
    REQUIRE_TYPE("stats\r", "matcher: 7 submitted, 0 refused, 4 done\r\n"
        "matcher errors: 0 config, 2 bus, 0 aborted, 1 timeouts, 0 stuck, 0 lost interrupts\r\n");
    REQUIRE(resets == 0);
    fake_stereo.hang = false;
    REQUIRE_TYPE("selftest\r", "selftest: passed");
    fake_stereo.wrong_pixel = true;
    REQUIRE_TYPE("selftest\r", "selftest: FAILED at (0, 0): 0 instead of -16");
    fake_stereo.wrong_pixel = false;
    REQUIRE(app.pool.frame[0].state == FRAME_EMPTY);
}

/* The firmware reports the cause of a reset, and resets on command. */
static void test_reset(void)
{
    boot();
    REQUIRE(strstr(out, "since power-up") == NULL);
    found_reset = (reset_report_t){RESET_WATCHDOG, 0x40001234, 77, 3, 0};
    boot();
    REQUIRE(strstr(out, "reset 3 since power-up: watchdog, at 0x40001234, line 77\r\n") != NULL);
    found_reset = (reset_report_t){0};
    type("reset\r");
    REQUIRE(resets == 1 && last_reset == RESET_REQUESTED);
}

/* A failed ENSURE is printed, and ends the program. */
static void test_ensure(void)
{
    boot();
    ENSURE(resets == 0);
    REQUIRE(resets == 0);
    type("");
    ENSURE(resets == 1);
    REQUIRE(resets == 1 && last_reset == RESET_ENSURE);
    REQUIRE(strstr(out, "tests/app/test_app.c:") != NULL && strstr(out, ": ensure failed, reset\r\n") != NULL);
}

static void test_wrong_gateware(void)
{
    fake_stereo.max_disparities = 0;
    type("");
    REQUIRE(app_init(&app, &app_buffers) == STATUS_UNSUPPORTED && strstr(out, "matcher") != NULL);
    fake_stereo.max_disparities = 64;
}

/* A firmware that cannot start does not wait for ever: it is reset after a second. */
static void test_give_up(void)
{
    uint64_t began;

    boot();
    began = now;
    app_give_up();
    REQUIRE(resets == 1 && last_reset == RESET_START && now - began >= 1000000 && now - began < 1010000);
}

int main(void)
{
    make_memory();
    test_console();
    test_bench();
    test_matcher();
    test_screen();
    test_no_match();
    test_stop();
    test_refused_settings();
    test_stuck();
    test_stops_late();
    test_small_devices();
    test_faults();
    test_reset();
    test_ensure();
    test_wrong_gateware();
    test_give_up();
    return 0;
}
