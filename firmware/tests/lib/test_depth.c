/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Distances against the formula in floating point: calibrations and disparities drawn at and around each limit. */

#include <math.h>
#include <stdio.h>

#include "litestereo/depth.h"
#include "require.h"

static uint64_t seed = 1;

static uint32_t draw(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(seed >> 32);
}

/* A number of any magnitude, with each limit now and then. */
static uint32_t draw_size(void)
{
    static const uint32_t limits[] = {0, 1, 2, 999, 1000, 1001, 0x7fffffff, 0x80000000, 0xfffffffe, 0xffffffff};

    return draw() % 4 == 0 ? limits[draw() % (sizeof(limits) / sizeof(limits[0]))] : draw() >> draw() % 32;
}

/* Tolerance for the rounding of the reference. */
static bool is_near(double value, double reference)
{
    return fabs(value - reference) <= 0.5 + reference * 0x1p-48;
}

static void require_depth(const stereo_camera_t *camera, int16_t disparity)
{
    uint32_t depth = depth_mm(camera, disparity);
    double   shift = (double)disparity / 16 + (double)camera->doffs_px16 / 16;
    double   mm    = (double)camera->focal_px16 / 16 * ((double)camera->baseline_um / 1000) / shift;
    bool     good;

    if (shift <= 0) {
        good = depth == DEPTH_FAR;
    } else if (depth == DEPTH_FAR) {
        good = mm >= DEPTH_FAR - 0.5 || is_near(depth, mm);
    } else {
        good = is_near(depth, mm);
    }
    if (!good) {
        fprintf(stderr, "focal %u, baseline %u, doffs %d, disparity %d: %u, but %.3f\n", camera->focal_px16,
            camera->baseline_um, camera->doffs_px16, disparity, depth, mm);
    }
    REQUIRE(good);
}

static void test_drawn(void)
{
    unsigned far = 0, near = 0;

    for (unsigned round = 0; round < 2000000; round++) {
        stereo_camera_t camera    = {.focal_px16 = draw_size(), .baseline_um = draw_size()};
        int16_t         disparity = (int16_t)draw_size();

        switch (draw() % 4) {
        case 0:
            camera.doffs_px16 = (int32_t)draw_size();
            break;
        case 1:
            camera.doffs_px16 = -disparity + (int32_t)(draw() % 5) - 2;
            break;
        default:
            camera.doffs_px16 = (int32_t)(draw() % 8192) - 4096;
            break;
        }
        require_depth(&camera, disparity);
        far  += depth_mm(&camera, disparity) == DEPTH_FAR;
        near += depth_mm(&camera, disparity) == 0;
    }
    REQUIRE(far > 100000 && far < 1900000 && near > 1000);
}

/* Where the result changes from a number to DEPTH_FAR, and from one millimetre to the next. */
static void test_limits(void)
{
    stereo_camera_t camera = {.focal_px16 = 1000, .baseline_um = UINT32_MAX};

    REQUIRE(depth_mm(&camera, 1) == DEPTH_FAR && depth_mm(&camera, 2) == 2147483648u);
    camera.baseline_um = UINT32_MAX - 1;
    REQUIRE(depth_mm(&camera, 1) == UINT32_MAX - 1);
    camera = (stereo_camera_t){.focal_px16 = UINT32_MAX, .baseline_um = UINT32_MAX, .doffs_px16 = INT32_MAX};
    REQUIRE(depth_mm(&camera, INT16_MAX) == 8589804 && depth_mm(&camera, INT16_MIN) == 8590066);
    camera = (stereo_camera_t){.focal_px16 = 16, .baseline_um = 1000, .doffs_px16 = -16};
    REQUIRE(depth_mm(&camera, 15) == DEPTH_FAR && depth_mm(&camera, 16) == DEPTH_FAR);
    REQUIRE(depth_mm(&camera, 17) == 16 && depth_mm(&camera, 47) == 1 && depth_mm(&camera, 48) == 1);
    REQUIRE(depth_mm(&camera, 49) == 0 && depth_mm(&camera, INT16_MIN) == DEPTH_FAR);
    camera.doffs_px16 = INT32_MIN;
    REQUIRE(depth_mm(&camera, INT16_MAX) == DEPTH_FAR);
    camera.focal_px16 = 0;
    REQUIRE(depth_mm(&camera, 1) == DEPTH_FAR);
    camera.doffs_px16 = 0;
    REQUIRE(depth_mm(&camera, 1) == 0 && depth_mm(&camera, 0) == DEPTH_FAR);
}

/* A calibration with principal points apart: Middlebury 2014, Adirondack, at a quarter of its size. */
static void test_real_calibration(void)
{
    const stereo_camera_t camera = {.focal_px16 = 16645, .baseline_um = 176252, .doffs_px16 = 836};
    stereo_camera_t       without = camera;

    REQUIRE(depth_mm(&camera, 1008) == 1591);
    without.doffs_px16 = 0;
    REQUIRE(depth_mm(&without, 1008) == 2910);  /* 83 % too far. */
}

int main(void)
{
    test_drawn();
    test_limits();
    test_real_calibration();
    return 0;
}
