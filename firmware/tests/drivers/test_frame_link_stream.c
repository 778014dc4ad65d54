/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver's part for streamed frames, register by register. */

#include "drivers/frame_link.h"
#include "mock_csr.h"
#include "require.h"

#define OPEN     1u
#define SENDING  2u
#define PATIENCE 100000u

static frame_link_t link = {.capabilities = {.streaming = true}};

static void expect_open(void)
{
    expect_read("stream_status", 0);
    expect_write("stream_frame_id", 0x87654321);
    expect_write("stream_pixels", 307200);
    expect_write("stream_sequence", 0x12345678);
    expect_write("stream_control", 1);
}

static void test_bad_arguments(void)
{
    frame_link_t without = {0};

    REQUIRE(frame_link_open_stream(NULL, 1, 1, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_stream(&link, 1, 0, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_stream(&without, 1, 1, 1) == STATUS_UNSUPPORTED);
    REQUIRE(frame_link_close_stream(NULL) == STATUS_BAD_ARGUMENT);
    require_all_done();
}

/* Busy until the previous frame has all its pairs, and has sent all of its map. */
static void test_open(void)
{
    static const uint32_t busy[] = {OPEN, SENDING, OPEN | SENDING};

    for (unsigned i = 0; i < sizeof(busy) / sizeof(busy[0]); i++) {
        expect_read("stream_status", busy[i]);
        REQUIRE(frame_link_open_stream(&link, 0x87654321, 307200, 0x12345678) == STATUS_BUSY);
        expect_read("stream_status", busy[i]);
        REQUIRE(frame_link_stream_busy(&link));
        require_all_done();
    }
    expect_open();
    REQUIRE(frame_link_open_stream(&link, 0x87654321, 307200, 0x12345678) == STATUS_OK);
    require_all_done();
    expect_read("stream_status", 0);
    REQUIRE(!frame_link_stream_busy(&link));
    require_all_done();
}

/* An offset counts only if pairs are missing after it was read. */
static void test_wanted(void)
{
    static const struct {
        uint32_t offset, status, wanted;
    } cases[] = {
        {0, OPEN, 0}, {1024, OPEN, 1024}, {614400 - 1024, OPEN | SENDING, 614400 - 1024},
        {614400 - 1024, SENDING, PROTOCOL_NO_OFFSET}, {614400, SENDING, PROTOCOL_NO_OFFSET},
        {614400, 0, PROTOCOL_NO_OFFSET}, {0, 0, PROTOCOL_NO_OFFSET},
    };

    for (unsigned i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        expect_read("stream_offset", cases[i].offset);
        expect_read("stream_status", cases[i].status);
        REQUIRE(frame_link_stream_wanted(&link) == cases[i].wanted);
        require_all_done();
    }
}

static void test_close(void)
{
    mock_clock_step = 10;
    expect_write("stream_control", 2);
    expect_read("stream_status", OPEN | SENDING);
    expect_read("stream_status", SENDING);
    expect_read("stream_status", 0);
    REQUIRE(frame_link_close_stream(&link) == STATUS_OK);
    require_all_done();
    /* The wait is bounded; the clock advances fast, so there are few polls. */
    mock_clock_step = PATIENCE / 2;
    expect_write("stream_control", 2);
    for (unsigned poll = 0; poll < 3; poll++) {
        expect_read("stream_status", SENDING);
    }
    REQUIRE(frame_link_close_stream(&link) == STATUS_TIMEOUT);
    require_all_done();
}

int main(void)
{
    test_bad_arguments();
    test_open();
    test_wanted();
    test_close();
    return 0;
}
