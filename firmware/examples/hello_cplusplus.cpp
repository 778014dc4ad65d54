/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* hello_disparity.c in C++: matches one pair, and prints the disparity in the middle. */

#include "litestereo/depth.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/stereo.h"
#include "scene.h"

namespace {

constexpr uint16_t WIDTH = 128, HEIGHT = 64;
constexpr uint8_t  WALL  = 12;

STEREO_ALIGNED uint8_t left[WIDTH * HEIGHT];
STEREO_ALIGNED uint8_t right[WIDTH * HEIGHT];
STEREO_ALIGNED int16_t map[WIDTH * HEIGHT];

stereo_t stereo;
serial_t serial;

status_t match(const stereo_job_t &job, stereo_result_t &result)
{
    const status_t status = stereo_submit(&stereo, &job, clock_now());

    return status == STATUS_OK ? stereo_wait(&stereo, &result) : status;
}

}  // namespace

int main()
{
    stereo_job_t    job{};
    stereo_result_t result{};
    uint32_t        seed = 1;

    serial_init(&serial);
    status_t status = stereo_init(&stereo);
    if (status != STATUS_OK) {
        print(&serial, "hello_cplusplus: no matcher that this program knows: %s\n", status_name(status));
        return 1;
    }
    job.left            = left;
    job.right           = right;
    job.map             = map;
    job.settings        = stereo_settings_default(&stereo.capabilities.limits);
    job.settings.width  = WIDTH;
    job.settings.height = HEIGHT;
    scene_fill(left, right, &job.settings, WALL, nullptr, 0, &seed);

    status = match(job, result);
    if (status != STATUS_OK) {
        print(&serial, "hello_cplusplus: FAILED: %s\n", status_name(status));
        return 1;
    }
    const int value = disparity_at(&job.settings, map, WIDTH * 3 / 4, HEIGHT / 2);
    print(&serial, "hello_cplusplus: %dx%d pixels in %u clocks, disparity %d/16 pixels\n", WIDTH, HEIGHT,
        static_cast<unsigned>(result.clocks), value);
    print(&serial, "hello_cplusplus: end\n");
    return 0;
}
