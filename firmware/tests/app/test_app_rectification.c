/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The whole firmware with a rectification: the calibration in flash from its start on, frames, and what it refuses. */

#include "app_fixture.h"
#include "drawn_calibration.h"
#include "fake_flash.h"
#include "fake_grids.h"
#include "lib/bytes.h"

static uint8_t  record[DRAWN_CALIBRATION_MOST];
static uint32_t size;

static void boot_rectifying(void)
{
    fake_stereo.features = 0x4ff;
    fake_grids.rows      = 16;
    boot();
    REQUIRE(app.session.calibrate == &app.calibrate);
}

/* Adopts a calibration as the session does, and keeps it in flash if there is one. */
static void adopt(int rows)
{
    size = draw_calibration(record, 40, 20, rows, rows);
    REQUIRE(calibrate_begin(&app.calibrate, size, get_u32(record + size - 4)) == STATUS_OK);
    for (uint32_t offset = 0; offset < size; offset += 1024) {
        REQUIRE(calibrate_store(&app.calibrate, offset, record + offset, calibrate_chunk_length(&app.calibrate, offset))
            == STATUS_OK);
    }
    REQUIRE(calibrate_adopt(&app.calibrate, app.records.flash != NULL) == STATUS_OK);
    for (int polls = 0; calibrate_is_running(&app.calibrate); polls++) {
        REQUIRE(polls < 100000);
        app_poll(&app);
    }
}

static frame_t *load_with(uint32_t id, uint8_t options)
{
    frame_t *frame = load_frame(id);

    REQUIRE(frame_set_options(&app.pool, frame, options) == STATUS_OK);
    for (unsigned i = 0; i < 800; i++) {
        frame_left(frame)[i]  = (uint8_t)(i * 7 ^ i >> 3);
        frame_right(frame)[i] = (uint8_t)(i * 11 ^ i >> 2);
    }
    return frame;
}

static void match(const frame_t *frame)
{
    for (int polls = 0; frame->state == FRAME_READY || frame->state == FRAME_MATCHING; polls++) {
        REQUIRE(polls < 100000);
        app_poll(&app);
    }
}

/* Both images are those of two rows further down, and the last two rows are black. */
static void require_shifted(const frame_t *frame, unsigned rows)
{
    for (unsigned i = 0; i < 800; i++) {
        REQUIRE(frame_left_out(frame)[i] == (i + 40 * rows < 800 ? frame_left(frame)[i + 40 * rows] : 0));
        REQUIRE(frame_right_out(frame)[i] == (i + 40 * rows < 800 ? frame_right(frame)[i + 40 * rows] : 0));
    }
}

/* A frame has the calibration in use when it begins. */
static void test_frames(void)
{
    const uint8_t all = OPTION_RECTIFIED | OPTION_LEFT | OPTION_RIGHT;
    frame_t      *first, *second;
    uint32_t      crc;

    boot_rectifying();
    adopt(2);
    REQUIRE(app.calibrate.state == CALIBRATE_DONE);
    crc    = app.rectification.calibration.grid_crc;
    first  = load_with(1, all);
    second = load_with(2, all);
    matcher_poll(&app.matcher, now);
    REQUIRE(first->state == FRAME_MATCHING);
    fake_stereo.hang = true;
    adopt(3);
    fake_stereo.hang = false;
    match(first);
    match(second);
    REQUIRE(first->state == FRAME_DONE && first->result.grid_crc == crc && first->result.flags == FLAG_RECTIFIED);
    require_shifted(first, 2);
    REQUIRE(second->state == FRAME_DONE && second->result.grid_crc == app.rectification.calibration.grid_crc);
    REQUIRE(second->result.grid_crc != crc);
    require_shifted(second, 3);
    frame_release(first);
    fake_stereo.flags = 3;
    first = load_with(3, all);
    match(first);
    REQUIRE(first->result.flags == (FLAG_RECTIFIED | FLAG_ROW_GONE | FLAG_FOLDED));
    fake_stereo.flags = 0;
    frame_release(first);
    /* Images that are not rectified come out as they are. */
    first = load_with(4, OPTION_LEFT | OPTION_RIGHT);
    match(first);
    REQUIRE(first->state == FRAME_DONE && first->result.flags == 0 && first->result.grid_crc == 0);
    require_shifted(first, 0);
    REQUIRE(calibrate_forget(&app.calibrate) == STATUS_OK);
    frame_release(second);
    second = load_with(5, OPTION_RECTIFIED);
    match(second);
    REQUIRE(second->state == FRAME_FAILED && second->result.error == ERROR_MATCHER);
    REQUIRE(second->result.detail == STEREO_ERROR_CONFIG && second->result.grid_crc == 0);
}

/* The calibration in flash is used from the start on, if the gateware keeps enough rows. */
static void test_power_up(void)
{
    uint32_t crc;

    fake_flash_reset();
    boot_rectifying();
    REQUIRE(app.rectification.calibration.width == 0 && strstr(out, "calibration") == NULL);
    adopt(5);
    REQUIRE(app.calibrate.state == CALIBRATE_DONE && app.calibrate.kept);
    crc = app.rectification.calibration.grid_crc;
    boot_rectifying();
    REQUIRE(app.rectification.calibration.grid_crc == crc && app.calibrate.kept && strstr(out, "calibration") == NULL);
    REQUIRE(app.pool.frame[0].memory >= app.calibrate.memory[1] + CALIBRATE_ROOM);
    fake_stereo.features = 0x4ff;
    fake_grids.rows      = 4;
    boot();
    REQUIRE(app.rectification.calibration.width == 0);
    REQUIRE(strstr(out, "The calibration needs 6 rows of the images, the gateware keeps 4: not used.") != NULL);
    fake_stereo.features = 0xff;
    boot();
    REQUIRE(app.session.calibrate == NULL && strstr(out, "calibration") == NULL);
    fake_flash.present = false;
}

int main(void)
{
    make_memory();
    fake_flash.present = false;
    test_frames();
    test_power_up();
    return 0;
}
