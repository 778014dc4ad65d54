/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Matches pairs of the cameras' test pattern, and prints what came out; for the cameras on the full system. */

#include <generated/csr.h>

#include "litestereo/crc32.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/serial.h"
#include "litestereo/stereo.h"

enum { WIDTH = 112, HEIGHT = 60, PAIRS = 3, ROW_BLANKING = 40, FRAME_BLANKING = 4000 };

/** Fields of the register `control`. */
enum { BOTH_ENABLED = 3, BOTH_PATTERNS = 3 << 2, SELECTED = 1 << 4, FREE_RUNNING = 1 << 6 };

static STEREO_ALIGNED uint8_t left[WIDTH * HEIGHT];
static STEREO_ALIGNED uint8_t right[WIDTH * HEIGHT];
static STEREO_ALIGNED int16_t map[WIDTH * HEIGHT];

static stereo_t stereo;
static serial_t serial;

static void show_pattern(uint32_t disparity)
{
    const uint32_t clocks = clock_hz();  /* A second. */

    cameras_control_write(SELECTED | FREE_RUNNING);
    cameras_size_write(WIDTH | HEIGHT << 16);
    cameras_silence_write(clocks / 8);
    cameras_clock_limit_write(1000);
    cameras_pair_window_write(20000);
    cameras_flag_limit_write(8);
    cameras_drop_limit_write(500);
    cameras_pattern_write(disparity | (uint32_t)ROW_BLANKING << 16);
    cameras_pattern_blanking_write(FRAME_BLANKING);
    cameras_window_columns_write((uint32_t)WIDTH << 16);
    cameras_window_rows_write((uint32_t)HEIGHT << 16);
    cameras_control_write(BOTH_ENABLED | BOTH_PATTERNS | SELECTED | FREE_RUNNING);
}

static status_t match(const stereo_job_t *job, stereo_result_t *result)
{
    status_t status = stereo_submit(&stereo, job, clock_now());

    if (status == STATUS_OK) {
        /* A pair that has just begun is not taken: it may be the second one from now. */
        stereo_allow(&stereo, clock_now(), clock_hz());
        status = stereo_wait(&stereo, result);
    }
    return status;
}

int main(void)
{
    stereo_job_t    job = {.left = left, .right = right, .map = map, .streamed = true, .left_out = left,
                           .right_out = right};
    stereo_result_t result;

    serial_init(&serial);
    if (stereo_init(&stereo) != STATUS_OK) {
        print(&serial, "cameras: no matcher\n");
        return 1;
    }
    job.settings        = stereo_settings_default(&stereo.capabilities.limits);
    job.settings.width  = WIDTH;
    job.settings.height = HEIGHT;
    for (uint32_t pair = 0; pair < PAIRS; pair++) {
        uint32_t disparity = 3 + 5 * pair;
        status_t status;

        show_pattern(disparity);
        status = match(&job, &result);
        if (status != STATUS_OK) {
            print(&serial, "cameras: FAILED: %s\n", status_name(status));
            return 1;
        }
        /* The sensors end their frames after their last rows. */
        for (uint64_t began = clock_now(); clock_now() - began < 2000;) {
        }
        print(&serial, "cameras: disparity=%u number=%u flags=%u skew=%d sum=%u map=0x%08x left=0x%08x right=0x%08x\n",
            (unsigned)disparity, (unsigned)cameras_number_read(), (unsigned)cameras_flags_read(),
            (int)cameras_skew_read(), (unsigned)cameras_left_sum_read(), (unsigned)crc32_update(0, map, sizeof map),
            (unsigned)crc32_update(0, left, sizeof left), (unsigned)crc32_update(0, right, sizeof right));
    }
    print(&serial, "cameras: end\n");
    return 0;
}
