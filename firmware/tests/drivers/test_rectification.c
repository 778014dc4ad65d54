/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The rectification's registers: what is loaded, what is refused, and jobs that use it. */

#include "litestereo/rectification.h"

#include <string.h>

#include "drawn_calibration.h"
#include "mock_csr.h"
#include "require.h"
#include "stereo_fixture.h"

#define WIDTH  20
#define HEIGHT 18
#define NODES  9u

static rectification_t rectification;
static uint8_t         record[2][DRAWN_CALIBRATION_MOST];

static void set_up_rectification(uint32_t rows)
{
    features = 0x4ff;
    set_up();
    expect_read("rows", rows | 40 << 16);
    expect_write("grid0_size", 0);
    expect_write("grid1_size", 0);
    REQUIRE(rectification_init(&rectification, &stereo) == STATUS_OK);
    require_all_done();
    REQUIRE(rectification.rows == rows && rectification.max_width == 640 && rectification.max_height == 40);
}

static void expect_load(unsigned grid, int rows, bool lost)
{
    for (unsigned camera = 0; camera < 2; camera++) {
        expect_write("place", grid << 16 | camera << 17);
        for (unsigned node = 0; node < NODES; node++) {
            expect_write("node", camera == 1 ? (uint32_t)(uint16_t)(rows * 128) << 16 : 0);
        }
        expect_read("rectification", lost ? 4 : 3);
        if (lost) {
            return;
        }
    }
    expect_write(grid == 0 ? "grid0_size" : "grid1_size", WIDTH | HEIGHT << 16);
}

static status_t use(unsigned number, int rows)
{
    return rectification_use(&rectification, record[number], draw_calibration(record[number], WIDTH, HEIGHT, 0, rows));
}

static void test_init(void)
{
    features = 0xff;
    set_up();
    REQUIRE(rectification_init(&rectification, &stereo) == STATUS_UNSUPPORTED);
    REQUIRE(rectification.rows == 0 && use(0, 0) == STATUS_UNSUPPORTED);
    REQUIRE(rectification_poll(&rectification) == STATUS_IDLE);
}

/* Calibrations alternate between the grids. */
static void test_use(void)
{
    set_up_rectification(24);
    REQUIRE(!rectification_fits(&rectification, WIDTH, HEIGHT) && !rectification_fits(&rectification, 0, 0));
    for (unsigned number = 0; number < 4; number++) {
        expect_load(number % 2, (int)number, false);
        REQUIRE(use(number % 2, (int)number) == STATUS_OK);
        require_all_done();
        REQUIRE(rectification.grid == number % 2 && rectification.calibration.record == record[number % 2]);
        REQUIRE(rectification_fits(&rectification, WIDTH, HEIGHT));
        REQUIRE(!rectification_fits(&rectification, WIDTH + 1, HEIGHT));
        REQUIRE(!rectification_fits(&rectification, WIDTH, HEIGHT - 1));
    }
    expect_write("grid0_size", 0);
    expect_write("grid1_size", 0);
    rectification_forget(&rectification);
    require_all_done();
    REQUIRE(!rectification_fits(&rectification, WIDTH, HEIGHT));
    expect_load(0, 1, false);
    REQUIRE(use(0, 1) == STATUS_OK);
    require_all_done();
}

/* The calibration in use stays. */
static void test_refused(void)
{
    uint32_t size;

    set_up_rectification(14);
    expect_load(0, 2, false);
    REQUIRE(use(0, 2) == STATUS_OK && rectification.rows_needed == 8);
    require_all_done();
    REQUIRE(use(1, 10) == STATUS_ROWS && rectification.rows_needed == 16 && rectification.rows == 14);
    size = draw_calibration(record[1], 641, 18, 0, 0);
    REQUIRE(rectification_use(&rectification, record[1], size) == STATUS_SIZE);
    size = draw_calibration(record[1], 20, 41, 0, 0);
    REQUIRE(rectification_use(&rectification, record[1], size) == STATUS_SIZE);
    size = draw_calibration(record[1], WIDTH, HEIGHT, 0, 0);
    set_calibration_node(record[1], size, 1, 4, -2048, 0);
    REQUIRE(rectification_use(&rectification, record[1], size) == STATUS_BAD_ARGUMENT);
    REQUIRE(rectification_use(&rectification, record[1], size - 1) == STATUS_LENGTH);
    REQUIRE(rectification.calibration.record == record[0] && rectification.grid == 0 && !rectification.checking);
    expect_load(1, 8, false);
    REQUIRE(use(1, 8) == STATUS_OK && rectification.rows_needed == 14);
    require_all_done();
}

/* A frame is matched with the grid to be loaded: it is loaded again when that has ended. */
static void test_busy(void)
{
    set_up_rectification(24);
    for (unsigned number = 0; number < 2; number++) {
        expect_load(number, 0, false);
        REQUIRE(use(number, 0) == STATUS_OK);
    }
    REQUIRE(rectification_begin(&rectification, record[0], draw_calibration(record[0], WIDTH, HEIGHT, 0, 3)) == STATUS_OK);
    REQUIRE(rectification_begin(&rectification, record[0], 0) == STATUS_BUSY);
    for (int row = 0; row < HEIGHT - 1; row++) {
        REQUIRE(rectification_poll(&rectification) == STATUS_BUSY);
    }
    for (int again = 0; again < 3; again++) {
        expect_load(0, 3, true);
        REQUIRE(rectification_poll(&rectification) == STATUS_BUSY);
        require_all_done();
        REQUIRE(rectification.grid == 1 && rectification.calibration.record == record[1]);
    }
    expect_load(0, 3, false);
    REQUIRE(rectification_poll(&rectification) == STATUS_OK);
    require_all_done();
    REQUIRE(rectification.grid == 0 && rectification_poll(&rectification) == STATUS_IDLE);
}

static void test_jobs(void)
{
    stereo_result_t result;

    set_up_rectification(24);
    job.rectified = true;
    job.grid      = 1;
    job.left_out  = (void *)(uintptr_t)0x40050000;
    job.right_out = (void *)(uintptr_t)0x40060008;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_RIGHT_OUT);
    job.right_out = NULL;
    job.left_out  = (void *)(uintptr_t)0x40050004;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_LEFT_OUT);
    job.left_out  = (void *)(uintptr_t)0x40050000;
    job.grid      = 2;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_RECTIFIED);
    job.grid      = 1;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_NONE);
    submit(0);
    interrupt(1);
    expect_end(5, 3);
    REQUIRE(stereo_poll(&stereo, 100, &result) == STATUS_OK && result.row_gone && !result.folded);
    require_all_done();
    /* Without the feature. */
    features = 0xff;
    set_up();
    job.left_out = (void *)(uintptr_t)0x40050000;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_LEFT_OUT);
    job.left_out  = NULL;
    job.right_out = (void *)(uintptr_t)0x40050000;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_RIGHT_OUT);
    job.right_out = NULL;
    job.rectified = true;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_RECTIFIED);
}

int main(void)
{
    test_init();
    test_use();
    test_refused();
    test_busy();
    test_jobs();
    return 0;
}
