/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The whole firmware on a fake accelerator and a scripted line: the console, faults, and a flood of random bytes. */

#define _DEFAULT_SOURCE

#include <string.h>
#include <sys/mman.h>

#include "app/app.h"
#include "fake_stereo.h"
#include "generated/csr.h"
#include "libbase/uart.h"
#include "litestereo/bytes.h"
#include "litestereo/platform.h"
#include "require.h"

/* Frame memory below 4 GiB, as the registers need it, with a page that must not be touched on either side. */
#define MEMORY_BASE 0x50000000u
#define MEMORY_SIZE (1u << 20)
#define PAGE        4096u

static app_t          app;
static uint8_t       *memory;
static const uint8_t *line;
static size_t         line_length;
static char           out[1 << 16];
static size_t         out_length;
static uint64_t       now;

/* Time goes on with each look at it, so that nothing can wait for ever. */
static uint64_t look_at_clock(void)
{
    return now;
}

uint64_t clock_now(void)
{
    now += 100;
    fake_stereo_advance();
    return now;
}

const char *platform_name(void)          { return "test"; }
uint32_t clock_hz(void)                  { return 1000000; }
void     memory_to_device(void)          {}
void     memory_from_device(void)        {}
uint32_t uart_rxempty_read(void)         { return line_length == 0; }
uint32_t uart_rxfull_read(void)          { return line_length >= 256; }
uint32_t uart_rxtx_read(void)            { return *line; }
uint32_t uart_txempty_read(void)         { return 1; }
uint32_t uart_txfull_read(void)          { return 0; }
void     uart_ev_enable_write(uint32_t value) { (void)value; }

void uart_ev_pending_write(uint32_t value)
{
    if ((value & UART_EV_RX) != 0) {
        line++;
        line_length--;
    }
}

void uart_rxtx_write(uint32_t value)
{
    if (out_length < sizeof(out) - 1) {
        out[out_length++] = (char)value;
        out[out_length]   = 0;
    }
}

void *platform_frame_memory(size_t *size)
{
    *size = MEMORY_SIZE;
    return memory;
}

static void handle_interrupt(void)
{
    stereo_isr(&app.stereo);
}

static void receive(const void *bytes, size_t length)
{
    line        = bytes;
    line_length = length;
    do {
        app_poll(&app);
    } while (line_length > 0);
}

static const char *type(const char *text)
{
    out_length = 0;
    out[0]     = 0;
    receive(text, strlen(text));
    return out;
}

static void boot(void)
{
    fake_stereo.hang      = false;
    fake_stereo.bus_error = false;
    memset(memory, 0, MEMORY_SIZE);
    out_length = 0;
    REQUIRE(app_init(&app) == STATUS_OK);
    fake_stereo_attach(handle_interrupt);
}

#define REQUIRE_TYPE(text, answer) REQUIRE(strstr(type(text), answer) != NULL)

static void test_console(void)
{
    boot();
    REQUIRE(strstr(out, "LiteStereo on test") != NULL && strstr(out, "litestereo> ") != NULL);
    REQUIRE_TYPE("help\r", "bench WIDTH HEIGHT DISPARITIES BLOCK_SIZE");
    REQUIRE_TYPE("info\n", "disparities: 16 to 64\r\n");
    REQUIRE(strcmp(type("\r"), "\r\nlitestereo> ") == 0);
    REQUIRE(strcmp(type("\n"), "") == 0);
    REQUIRE(strcmp(type("x\b"), "x\b \b") == 0);
    REQUIRE_TYPE("  stats  \r", "console_lines: 3\r\n");
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
}

static void test_bench(void)
{
    static const char *const wrong[] = {
        "bench\r", "bench 64 32 16\r", "bench 64 32 16 5 1\r", "bench 64 32 16 x\r", "bench -64 32 16 5\r",
        "bench 64 32 16 5x\r", "bench 0 32 16 5\r", "bench 65600 32 16 5\r", "bench 64 32 16 261\r",
    };
    frame_settings_t settings = {.width = 20, .height = 20};
    frame_t         *frame[FRAME_POOL_SLOTS];

    boot();
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        REQUIRE_TYPE(wrong[i], "usage: bench");
    }
    REQUIRE_TYPE("bench 64 32 20 5\r", "bench: refused: bad disparities\r\n");
    REQUIRE_TYPE("bench 64 32 16 6\r", "bench: refused: bad block_size\r\n");
    REQUIRE_TYPE("bench 19 32 16 5\r", "bench: refused: bad width\r\n");
    REQUIRE_TYPE("bench 64 4 16 5\r", "bench: refused: bad height\r\n");
    REQUIRE_TYPE("bench 640 480 16 5\r", "bench: refused: a slot holds at most");
    REQUIRE_TYPE("bench 61 33 16 5\r",
        "bench: width=61 height=33 disparities=16 block_size=5 clocks=2013 first_row_clocks=183 crc32=0x");
    for (uint32_t i = 0; i < FRAME_POOL_SLOTS; i++) {
        REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_LINK, i, &settings, &frame[i]) == STATUS_OK);
    }
    REQUIRE_TYPE("bench 64 32 16 5\r", "bench: refused: no slot is free\r\n");
    REQUIRE_TYPE("selftest\r", "selftest: refused: no slot is free\r\n");
}

static frame_t *load(uint32_t id)
{
    frame_settings_t settings = {.width = 40, .height = 20, .disparities = 16, .block_size = 5};
    frame_t         *frame;

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

/* An accelerator that does not even stop costs bounded waits, and works again once it does. */
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
    fake_stereo.hang = fake_stereo.stuck = false;
    fake_stereo_advance();
    REQUIRE_TYPE("selftest\r", "selftest: passed");
}

static void test_faults(void)
{
    boot();
    REQUIRE_TYPE("selftest\r", "selftest: passed, 3 frames");
    fake_stereo.bus_error = true;
    REQUIRE_TYPE("bench 64 32 16 5\r", "bench: FAILED: the matcher ended with error 2\r\n");
    REQUIRE_TYPE("selftest\r", "selftest: FAILED: the matcher ended with error 2\r\n");
    fake_stereo.bus_error = false;
    fake_stereo.hang      = true;
    REQUIRE_TYPE("bench 64 32 16 5\r", "bench: FAILED: the matcher did not finish in");
    REQUIRE_TYPE("stats\r", "matcher_timeouts: 1\r\n");
    REQUIRE_TYPE("stats\r", "frames_failed: 3\r\n");
    fake_stereo.hang = false;
    REQUIRE_TYPE("selftest\r", "selftest: passed");
    fake_stereo.wrong_pixel = true;
    REQUIRE_TYPE("selftest\r", "selftest: FAILED at (0, 0): 0 instead of -16");
    fake_stereo.wrong_pixel = false;
    REQUIRE(app.pool.frame[0].state == FRAME_EMPTY);
}

static void test_wrong_gateware(void)
{
    fake_stereo.max_disparities = 0;
    out_length = 0;
    REQUIRE(app_init(&app) == STATUS_UNSUPPORTED && strstr(out, "matcher") != NULL);
    fake_stereo.max_disparities = 64;
}

/* A length of payload that suits the request, most of the time. */
static uint32_t likely_length(const message_t *message, unsigned *random)
{
    const frame_t *frame = frame_pool_find(&app.pool, FRAME_OWNER_LINK, message->frame_id);

    if (next_random(random) % 32 == 0) {
        return next_random(random) % (PROTOCOL_CHUNK_SIZE + 1);
    }
    switch (message->type) {
    case TYPE_HELLO:
    case TYPE_OPEN:
    case TYPE_READ:
        return 4;
    case TYPE_UPLOAD:
        return frame != NULL ? frame_chunk_length(frame, message->offset) : PROTOCOL_CHUNK_SIZE;
    default:
        return 0;
    }
}

/* Bytes as an unlucky line would deliver them: noise, pieces of frames, and frames with a byte changed. The valid
 * ones open, load and start frames, so the noise meets a device that is at work. */
static size_t make_noise(unsigned *random, uint8_t *bytes)
{
    static const uint8_t types[] = {TYPE_CONFIGURE, TYPE_OPEN, TYPE_OPEN, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD,
        TYPE_UPLOAD, TYPE_UPLOAD, TYPE_UPLOAD, TYPE_START, TYPE_START, TYPE_STATUS, TYPE_READ, TYPE_READ,
        TYPE_STATISTICS};
    static const uint8_t rare[] = {TYPE_HELLO, TYPE_HELLO, TYPE_RELEASE, TYPE_RELEASE, TYPE_RELEASE, TYPE_BYE, 0x7f,
        0x81};
    uint8_t   payload[PROTOCOL_CHUNK_SIZE], buffer[PROTOCOL_MESSAGE_MAX];
    message_t message = {.version = 1, .payload = payload};
    size_t    length;

    if (next_random(random) % 8 == 0) {
        length = next_random(random) % 600;
        for (size_t i = 0; i < length; i++) {
            bytes[i] = (uint8_t)(next_random(random) >> 7);
        }
        return length;
    }
    message.type     = next_random(random) % 16 == 0 ? rare[next_random(random) % sizeof(rare)]
        : types[next_random(random) % sizeof(types)];
    message.session  = next_random(random) % 32 == 0 ? next_random(random) : app.session.token;
    message.frame_id = 1 + next_random(random) % 2;
    message.offset   = next_random(random) % 4 * 1024 + (next_random(random) % 32 == 0);
    message.length   = likely_length(&message, random);
    for (uint32_t i = 0; i < message.length; i++) {
        payload[i] = (uint8_t)(next_random(random) >> 9);
    }
    if (message.type == TYPE_OPEN) {
        put_u16(payload, 70 + (uint16_t)(next_random(random) % 18));
        put_u16(payload + 2, 7 + (uint16_t)(next_random(random) % 18));
    } else if (message.type == TYPE_READ) {
        put_u32(payload, next_random(random) % 1030);
    }
    bytes[0] = 0;
    length   = 1 + cobs_encode(buffer, message_build(&message, buffer), bytes + 1);
    bytes[length++] = 0;
    if (next_random(random) % 6 == 0) {
        bytes[next_random(random) % length] = (uint8_t)next_random(random);
    }
    return next_random(random) % 20 == 0 ? next_random(random) % length : length;
}

static void test_flood(unsigned seed)
{
    static uint8_t bytes[COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2];
    size_t         total = 0;

    boot();
    for (size_t round = 0; total < 4000000; round++) {
        size_t length = make_noise(&seed, bytes);

        out_length = 0;
        receive(bytes, length);
        total += length;
        fake_stereo.hang      = round / 64 % 8 == 0;
        fake_stereo.bus_error = round / 32 % 8 == 5;
        now += next_random(&seed) % (fake_stereo.hang ? 3 : 64) == 0 ? 2000000 : 0;
        for (unsigned idle = next_random(&seed) % 4; idle > 0; idle--) {
            app_poll(&app);
        }
    }
    /* Nothing was left out: every counter that the noise can reach has moved. */
    for (unsigned counter = 0; counter < COUNTERS; counter++) {
        if (app.counters.value[counter] == 0) {
            fprintf(stderr, "%s has not moved\n", counter_name(counter));
        }
        REQUIRE(app.counters.value[counter] > 0);
    }
    /* And it is still there. */
    fake_stereo.hang = fake_stereo.bus_error = false;
    now += 2000000;
    app_poll(&app);
    type("\r");
    REQUIRE_TYPE("stats\r", "messages_received: ");
}

int main(int argc, char **argv)
{
    memory = mmap((void *)(uintptr_t)(MEMORY_BASE - PAGE), MEMORY_SIZE + 2 * PAGE, PROT_NONE,
        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    memory += PAGE;
    REQUIRE(mprotect(memory, MEMORY_SIZE, PROT_READ | PROT_WRITE) == 0);
    fake_stereo.clock = look_at_clock;
    test_console();
    test_bench();
    test_matcher();
    test_stop();
    test_refused_settings();
    test_stuck();
    test_faults();
    test_wrong_gateware();
    test_flood(argc > 1 ? (unsigned)strtoul(argv[1], NULL, 0) : 1);
    return 0;
}
