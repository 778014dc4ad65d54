/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The console, the way of frames through the matcher, and faults. */

#include "app_fixture.h"
#include "fake_flash.h"
#include "fake_frame_link.h"
#include "fake_screen.h"
#include "generated/csr.h"
#include "litestereo/crc32.h"
#include "litestereo/ensure.h"
#include "litestereo/firmware_tag.h"

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
    /* Nobody typed that, so nobody is answered. */
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

static frame_t *load(uint32_t id)
{
    stereo_settings_t settings = stereo_settings_bare(&app.info.limits);
    frame_t          *frame;

    settings.width       = 40;
    settings.height      = 20;
    settings.disparities = 16;
    settings.block_size  = 5;
    REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_LINK, id, &settings, &frame) == STATUS_OK);
    REQUIRE(frame_fill(frame) == STATUS_OK && frame_pool_start(&app.pool, frame) == STATUS_OK);
    return frame;
}

/* Frames are matched one at a time, in the order of their starts, and each gets its own map. */
static void test_matcher(void)
{
    frame_t *frame[3];

    boot();
    for (uint32_t i = 0; i < 3; i++) {
        frame[i] = load(i);
    }
    for (uint32_t i = 0; i < 3; i++) {
        app_poll(&app);
        for (int turns = 0; frame[i]->state == FRAME_MATCHING; turns++) {
            REQUIRE(turns < 100 && (i == 2 || frame[i + 1]->state == FRAME_READY));
            app_poll(&app);
        }
        REQUIRE(frame[i]->state == FRAME_DONE && frame[i]->result.clocks == 800);
        REQUIRE(frame_map(frame[i])[0] == 0xf0 && frame_map(frame[i])[1] == 0xff);
    }
    REQUIRE(app.counters.value[COUNTER_FRAMES_MATCHED] == 3 && app.counters.value[COUNTER_FRAMES_FAILED] == 0);
    REQUIRE(app.counters.value[COUNTER_MATCHER_INTERRUPTS] == 3);
}

/* What is done is seen: the map in the middle of the screen, and black around it. */
static void test_screen(void)
{
    frame_t *frame;

    boot();
    REQUIRE(shown_pixel(0, 0) == 0 && shown_pixel(63, 47) == 0);
    frame = load(1);
    while (frame->state != FRAME_DONE) {
        app_poll(&app);
    }
    /* The accelerator here finds nothing. The last row is not drawn in that turn. */
    ((int16_t *)(void *)frame_map(frame))[40 * 19 + 39] = 240;
    for (int turns = 0; fake_screen.shows == 0; turns++) {
        REQUIRE(turns < 10);
        app_poll(&app);
    }
    REQUIRE(shown_pixel(51, 33) == 255 && shown_pixel(51, 32) == 0 && shown_pixel(52, 33) == 0);
}

/* A frame that lacks pixels is not matched, and nobody waits for it; nor is a streamed one that has no way. */
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

/* A stopped match writes nothing any more, and the next one is not held up. */
static void test_stop(void)
{
    frame_t *frame, *next;

    boot();
    frame = load(1);
    next  = load(2);
    app_poll(&app);
    REQUIRE(frame->state == FRAME_MATCHING);
    matcher_stop(&app.matcher, frame);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.detail == STEREO_ERROR_ABORTED);
    REQUIRE((stereo_status_read() & 1) == 0);
    for (int turns = 0; turns < 100; turns++) {
        app_poll(&app);
    }
    REQUIRE(frame_map(frame)[0] == 0 && next->state == FRAME_DONE);
}

/* Settings that the gateware does not take fail the frame, not the device. */
static void test_refused_settings(void)
{
    frame_t *frame;

    boot();
    frame = load(1);
    frame->settings.block_size = 6;
    app_poll(&app);
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_MATCHER);
    REQUIRE(frame->result.detail == STEREO_ERROR_CONFIG);
}

/* An accelerator that does not even stop costs bounded waits and a reset, and works again once it does. */
static void test_stuck(void)
{
    frame_t *frame, *next;

    boot();
    fake_stereo.hang = fake_stereo.stuck = true;
    frame = load(1);
    next  = load(2);
    for (int turns = 0; turns < 10000; turns++) {
        app_poll(&app);
    }
    REQUIRE(frame->state == FRAME_FAILED && frame->result.error == ERROR_TIMEOUT && frame->result.detail > 100000);
    REQUIRE(next->state == FRAME_FAILED && next->result.error == ERROR_TIMEOUT && next->result.detail == 0);
    REQUIRE(resets == 1 && last_reset == RESET_MATCHER);
    fake_stereo.hang = fake_stereo.stuck = false;
    fake_stereo_advance();
    REQUIRE_TYPE("selftest\r", "selftest: passed");
}

/* One that stops at a second asking costs the frame, but no reset. */
static void test_stops_late(void)
{
    frame_t *frame, *next;

    boot();
    fake_stereo.hang = true;
    frame = load(1);
    next  = load(2);
    for (int turns = 0; frame->state != FRAME_FAILED; turns++) {
        REQUIRE(turns < 10000);
        /* More than are asked in the time that the driver has, less than in twice that. */
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

/* A matcher that is too small for all cases is not called sound; nor is one whose frames are too large for memory. */
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
    REQUIRE(app_init(&app) == STATUS_SIZE && strstr(out, "8192 bytes of memory are too few for frames.") != NULL);
    /* Frames go before the screen. */
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

/* The firmware says why it began anew, and does so when it is told. */
static void test_reset(void)
{
    boot();
    REQUIRE(strstr(out, "since power-up") == NULL);
    found_reset = (reset_report_t){RESET_WATCHDOG, 0x40001234, 77, 3};
    boot();
    REQUIRE(strstr(out, "reset 3 since power-up: watchdog, at 0x40001234, line 77\r\n") != NULL);
    found_reset = (reset_report_t){0};
    type("reset\r");
    REQUIRE(resets == 1 && last_reset == RESET_REQUESTED);
}

/* A mistake in the program is said, and is the last thing that it does. */
static void test_ensure(void)
{
    boot();
    ENSURE(resets == 0);
    REQUIRE(resets == 0);
    type("");
    ENSURE(resets == 1);
    REQUIRE(resets == 1 && last_reset == RESET_ENSURE);
    REQUIRE(strstr(out, "tests/test_app.c:") != NULL && strstr(out, ": ensure failed, reset\r\n") != NULL);
}

static void test_wrong_gateware(void)
{
    fake_stereo.max_disparities = 0;
    type("");
    REQUIRE(app_init(&app) == STATUS_UNSUPPORTED && strstr(out, "matcher") != NULL);
    fake_stereo.max_disparities = 64;
}

static bool send_nothing(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    (void)peer;
    (void)bytes;
    (void)length;
    return true;
}

/* A message comes in by UDP, and the firmware takes its turns. */
static void post(uint8_t type, uint32_t offset, const uint8_t *payload, uint32_t length)
{
    static const peer_t peer = {.udp = true, .address = 1, .port = 2};
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX];
    message_t message = {
        .version = 1, .type = type, .session = app.session.token, .frame_id = 5, .offset = offset, .length = length,
        .payload = payload,
    };

    fake_frame_link_receive(&peer, bytes, message_build(&message, bytes));
    app_poll(&app);
    app_poll(&app);
}

/* The main loop serves UDP, and sees that chunks which it does not get keep a session alive. */
static void test_udp_session(void)
{
    static const uint8_t size[4] = {80, 0, 20, 0}, chunk[PROTOCOL_CHUNK_SIZE];

    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    boot();
    post(TYPE_HELLO, 0, size, 4);
    post(TYPE_OPEN, 0, size, 4);
    REQUIRE(app.session.open && app.session.peer.udp && app.pool.frame[0].state == FRAME_LOADING);
    for (int turn = 0; turn < 3; turn++) {
        now += 4000000;
        post(TYPE_UPLOAD, 0, chunk, sizeof(chunk));
        now += 20000;
        app_poll(&app);
        REQUIRE(now - app.session.heard < 30000);
    }
    REQUIRE(app.counters.value[COUNTER_CHUNKS_RECEIVED] == 1 && app.counters.value[COUNTER_CHUNKS_REPEATED] == 2);
    post(TYPE_BYE, 0, NULL, 0);
    REQUIRE(!app.session.open && app.pool.frame[0].state == FRAME_EMPTY);
    fake_frame_link.version = 0;
}

/* With UDP, without it, and with one that is not known or does not come to rest: the line works all the same. */
static void test_udp(void)
{
    static const peer_t peer = {.udp = true, .address = 1, .port = 2};

    boot();
    REQUIRE(strstr(type("info\r"), "udp") == NULL && strstr(type("stats\r"), "datagrams_received: 0\r\n") != NULL);
    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    fake_frame_link.address = 0xc0a80132;
    fake_frame_link.port    = 50000;
    boot();
    REQUIRE(strstr(out, "no UDP") == NULL);
    REQUIRE_TYPE("info\r", "udp: 192.168.1.50 port 50000\r\n");
    fake_frame_link_receive(&peer, (const uint8_t *)"?", 1);
    REQUIRE_TYPE("stats\r", "datagrams_received: 1\r\n");
    REQUIRE_TYPE("stats\r", "datagrams_malformed: 1\r\n");
    fake_frame_link.version = FRAME_LINK_VERSION + 1;
    boot();
    REQUIRE(strstr(out, "no UDP") != NULL && strstr(out, "litestereo> ") != NULL);
    REQUIRE(strstr(type("info\r"), "udp:") == NULL);
    REQUIRE_TYPE("selftest\r", "selftest: passed");
    fake_frame_link.version = 0;
    boot();
    REQUIRE(strstr(out, "no UDP") == NULL);
}

/* While the flash is written frames are matched as ever, and the line is served. */
static void test_update(void)
{
    static uint8_t firmware[5000];
    uint32_t       pixels, matched = 0, answers = 0;

    boot();
    pixels = app.pool.max_pixels;
    REQUIRE(app.session.update == NULL);
    REQUIRE_TYPE("info\r", "flash: none\r\n");
    fake_flash_reset();
    fake_flash.busy_looks = 50;
    boot();
    REQUIRE(app.session.update == &app.update && app.pool.max_pixels < pixels);
    REQUIRE(app.pool.frame[0].memory >= app.update.image + app.flash.image_bytes);
    REQUIRE_TYPE("info\r", "flash: id 0xef4015, 2 images of 262144 bytes\r\n");
    memset(firmware, 7, sizeof(firmware));
    memcpy(firmware + sizeof(firmware) - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
    REQUIRE(update_begin(&app.update, sizeof(firmware), crc32_update(0, firmware, sizeof(firmware))) == STATUS_OK);
    for (uint32_t offset = 0; offset < sizeof(firmware); offset += 1024) {
        REQUIRE(update_take(&app.update, offset, firmware + offset, update_chunk_length(&app.update, offset)) == STATUS_OK);
    }
    REQUIRE(update_write(&app.update) == STATUS_OK);
    for (uint32_t turns = 0; update_is_running(&app.update); turns++) {
        REQUIRE(turns < 100000);
        if (frame_pool_next(&app.pool) == NULL && frame_pool_matching(&app.pool) == NULL) {
            for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
                matched += app.pool.frame[slot].state == FRAME_DONE;
                (void)frame_release(&app.pool.frame[slot]);
            }
            load(turns);
        }
        answers += strstr(type("\r"), "litestereo> ") != NULL;
    }
    REQUIRE(app.update.state == UPDATE_DONE && memcmp(fake_flash.contents + 0x100008, firmware, sizeof(firmware)) == 0);
    REQUIRE(matched > 50 && app.counters.value[COUNTER_FRAMES_FAILED] == 0 && answers > 2 * 22 * 50);
    fake_flash.present = false;
}

/* The reply to RESTART has a tenth of a second to leave. */
static void test_restart(void)
{
    uint64_t begin;

    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    boot();
    post(TYPE_HELLO, 0, (const uint8_t *)"abcd", 4);
    begin = now;
    post(TYPE_RESTART, 0, NULL, 0);
    while (resets == 0) {
        REQUIRE(now - begin < 110000);
        app_poll(&app);
    }
    REQUIRE(now - begin >= 100000 && last_reset == RESET_REQUESTED);
    fake_frame_link.version = 0;
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
    test_udp();
    test_udp_session();
    test_update();
    test_restart();
    test_reset();
    test_ensure();
    test_wrong_gateware();
    return 0;
}
