/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The smallest program: matches one pair, and prints the disparity in the middle. */

#include "litestereo/depth.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/stereo.h"
#include "scene.h"

enum { WIDTH = 128, HEIGHT = 64, WALL = 12 };

static STEREO_ALIGNED uint8_t left[WIDTH * HEIGHT];
static STEREO_ALIGNED uint8_t right[WIDTH * HEIGHT];
static STEREO_ALIGNED int16_t map[WIDTH * HEIGHT];

static stereo_t stereo;
static serial_t serial;

int main(void)
{
    stereo_job_t    job  = {.left = left, .right = right, .map = map};
    uint32_t        seed = 1;
    stereo_result_t result;
    status_t        status;
    int             value;

    serial_init(&serial);
    status = stereo_init(&stereo);
    if (status != STATUS_OK) {
        print(&serial, "hello_disparity: no matcher that this program knows: %s\n", status_name(status));
        return 1;
    }
    job.settings        = stereo_settings_default(&stereo.capabilities.limits);
    job.settings.width  = WIDTH;
    job.settings.height = HEIGHT;
    scene_fill(left, right, &job.settings, WALL, NULL, 0, &seed);

    status = stereo_submit(&stereo, &job, clock_now());
    if (status == STATUS_OK) {
        status = stereo_wait(&stereo, &result);
    }
    if (status != STATUS_OK) {
        print(&serial, "hello_disparity: FAILED: %s\n", status_name(status));
        return 1;
    }
    value = disparity_at(&job.settings, map, WIDTH * 3 / 4, HEIGHT / 2);
    print(&serial, "hello_disparity: %dx%d pixels in %u clocks, disparity %d/16 pixels\n", WIDTH, HEIGHT,
        (unsigned)result.clocks, value);
    print(&serial, "hello_disparity: end\n");
    return 0;
}
