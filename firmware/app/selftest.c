/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

#include "commands.h"
#include "lib/pattern.h"
#include "reference/stereo_bm.h"

/* Most pixels of a case: memory for the CPU's map is static. */
#define MAX_PIXELS 8192u

/* A case. Columns and rows are added to the smallest image with a valid pixel; odd widths let rows begin anywhere in a
 * word. */
typedef struct {
    uint16_t disparities;  /* 0 for the gateware's maximum. */
    uint8_t  block_size;   /* 0 for the gateware's smallest, UINT8_MAX for its largest. */
    uint8_t  columns;
    uint8_t  rows;
    bool     all;          /* All stages that are built, or as few as possible. */
    uint32_t mask;         /* Bits of a pixel in use: few bits make many equal costs. */
} case_t;

static const case_t cases[] = {
    {16, 0,         14, 6, false, 0xffffffff},
    {32, 9,         11, 5, false, 0x03030303},
    {16, 0,         23, 8, true,  0x0f0f0f0f},
    {0,  UINT8_MAX, 12, 4, true,  0xffffffff},
};

static int16_t expected[MAX_PIXELS];

static stereo_settings_t case_settings(const case_t *test, const stereo_limits_t *limits)
{
    stereo_settings_t settings = test->all ? settings_with_all_stages(limits) : stereo_settings_bare(limits);

    settings.disparities = test->disparities == 0 ? limits->max_disparities : test->disparities;
    settings.block_size  = test->block_size == 0 ? limits->min_block_size : test->block_size;
    if (test->block_size == UINT8_MAX) {
        settings.block_size = limits->max_block_size;
    }
    settings.width  = (uint16_t)(stereo_settings_min_width(&settings) + test->columns);
    settings.height = settings.block_size + test->rows;
    return settings;
}

/* The left image is a texture; the right one is the same, shifted by a disparity that differs per row, with some
 * noise. */
static void draw_pair(const frame_t *frame, uint32_t mask)
{
    uint32_t  width  = frame->settings.width;
    uint32_t  height = frame->settings.height;
    uint32_t  noise  = 1;
    uint8_t  *left   = frame_left(frame);
    uint8_t  *right  = frame_right(frame);

    pattern_fill(left, width * height, 1);
    for (uint32_t i = 0; i < width * height; i++) {
        left[i] &= (uint8_t)mask;
    }
    for (uint32_t y = 0; y < height; y++) {
        uint32_t shift = y * 3 % frame->settings.disparities;

        for (uint32_t x = 0; x < width; x++) {
            noise = pattern_next(noise);
            right[y * width + x] = left[y * width + (x + shift) % width] ^ (noise >> 31);
        }
    }
}

static bool compare(console_t *console, const frame_t *frame)
{
    const stereo_settings_t *settings = &frame->settings;
    uint32_t                pixels   = frame_pixels(frame);
    const uint8_t          *map      = frame_map(frame);

    stereo_bm(settings, frame_left(frame), frame_right(frame), expected, cpu_scratch);
    for (uint32_t i = 0; i < pixels; i++) {
        int16_t found;

        memcpy(&found, map + 2 * i, sizeof(found));
        if (found != expected[i]) {
            console_printf(console, "selftest: FAILED at (%u, %u): %d instead of %d, %ux%u, %u disparities,"
                " block size %u\n", (unsigned)(i % settings->width), (unsigned)(i / settings->width), found,
                expected[i], settings->width, settings->height, settings->disparities, settings->block_size);
            return false;
        }
    }
    return true;
}

static bool run_case(console_t *console, const case_t *test, const stereo_settings_t *settings)
{
    frame_t *frame;
    bool     passed = false;

    if (frame_pool_open(console->matcher->pool, FRAME_OWNER_CONSOLE, 0, settings, &frame) != STATUS_OK) {
        console_printf(console, "selftest: refused: no slot is free\n");
        return false;
    }
    draw_pair(frame, test->mask);
    frame_fill(frame);
    if (matcher_run(console->matcher, frame) == FRAME_DONE) {
        passed = compare(console, frame);
    } else {
        print_failure(console, "selftest", frame);
    }
    frame_release(frame);
    return passed;
}

static bool is_possible(const console_t *console, const stereo_settings_t *settings)
{
    const device_info_t *info   = console->info;
    uint32_t             pixels = (uint32_t)settings->width * settings->height;

    return stereo_settings_check(settings, &info->limits) == STEREO_FIELD_NONE && settings->width <= info->max_width
        && stereo_bm_scratch_words(settings) <= CPU_SCRATCH_WORDS && pixels <= MAX_PIXELS
        && pixels <= console->matcher->pool->max_pixels;
}

bool command_selftest(console_t *console, char **argv)
{
    unsigned done   = 0;
    unsigned pixels = 0;

    (void)argv;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        stereo_settings_t settings = case_settings(&cases[i], &console->info->limits);

        if (!is_possible(console, &settings)) {
            continue;
        }
        if (!run_case(console, &cases[i], &settings)) {
            return true;
        }
        done++;
        pixels += (unsigned)settings.width * settings.height;
    }
    if (done == 0) {
        console_printf(console, "selftest: FAILED: the device takes none of the cases\n");
    } else {
        console_printf(console, "selftest: passed, %u frames, %u pixels\n", done, pixels);
    }
    return true;
}
