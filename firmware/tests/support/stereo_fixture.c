/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "stereo_fixture.h"

#include <stddef.h>

#include "mock_csr.h"
#include "require.h"

stereo_t     stereo;
stereo_job_t job;

static uint8_t *address(uintptr_t value)
{
    return (uint8_t *)value;
}

uint32_t features = 0xff;

void expect_capabilities(uint32_t version, uint32_t width, uint32_t disparities, uint32_t sizes, uint32_t alignment)
{
    expect_read("block_sizes", sizes);
    expect_read("version", version);
    expect_read("max_width", width);
    expect_read("max_disparities", disparities);
    expect_read("features", features);
    expect_read("max_prefilter_cap", 50);
    expect_read("dma_alignment", alignment);
}

void set_up(void)
{
    mock_clock      = 0;
    mock_clock_step = 10;
    expect_capabilities(0x0005, 640, 64, 21 << 8 | 5, 16);
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    expect_write("ev_enable", 3);
    REQUIRE(stereo_init(&stereo) == STATUS_OK);
    require_all_done();
    job = (stereo_job_t){
        .left = address(0x40010000), .right = address(0x40020000), .map = address(0x40030000),
        .settings = {
            .width = 320, .height = 240, .disparities = 32, .block_size = 9, .min_disparity = 4, .xsobel = true,
            .prefilter_cap = 31, .texture_threshold = 0x12345, .uniqueness_ratio = 15, .disp12_max_diff = -1,
            .subpixel = true,
        },
    };
}

static void expect_submission(void)
{
    expect_read("status", 0);
    expect_write("left_base", 0x40010000);
    expect_write("right_base", 0x40020000);
    expect_write("disparity_base", 0x40030000);
    if ((features & LITESTEREO_FEATURE_RECTIFICATION) != 0) {
        expect_write("left_out_base", (uint32_t)(uintptr_t)job.left_out);
        expect_write("right_out_base", (uint32_t)(uintptr_t)job.right_out);
    }
    expect_write("width", 320);
    expect_write("height", 240);
    expect_write("disparities", 32);
    expect_write("block_size", 9);
    expect_write("min_disparity", 4);
    expect_write("prefilter_cap", 31);
    expect_write("texture_threshold", 0x12345);
    expect_write("uniqueness_ratio", 15);
    expect_write("disp12_max_diff", job.settings.disp12_max_diff < 0 ? 255 : (uint32_t)job.settings.disp12_max_diff);
    expect_write("options", (job.settings.xsobel ? 1 : 0) | (job.settings.subpixel ? 2 : 0)
        | (job.settings.median ? 4 : 0) | (job.streamed ? 8 : 0) | (job.rectified ? 16u + 32u * job.grid : 0)
        | (job.left_out != NULL ? 64 : 0) | (job.right_out != NULL ? 128 : 0));
    expect_write("ev_pending", 3);
    expect_call("memory_to_device");
    expect_write("control", 1);
}

void submit(uint64_t clock)
{
    expect_submission();
    REQUIRE(stereo_submit(&stereo, &job, clock) == STATUS_OK);
    require_all_done();
}

void interrupt(uint32_t pending)
{
    expect_read("ev_pending", pending);
    expect_write("ev_pending", pending);
    stereo_isr(&stereo);
    require_all_done();
}

void expect_end(uint32_t clocks, uint32_t first_row_clocks)
{
    expect_read("status", 0);
    expect_read("status", 0);
    expect_read("clocks", clocks);
    expect_read("first_row_clocks", first_row_clocks);
    if ((features & LITESTEREO_FEATURE_RECTIFICATION) != 0) {
        expect_read("rectification", 1);
    }
    expect_call("memory_from_device");
}
