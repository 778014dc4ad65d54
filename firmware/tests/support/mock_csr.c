/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "mock_csr.h"

#include <string.h>

#include "generated/csr.h"
#include "litestereo/platform.h"
#include "require.h"

typedef struct {
    char        kind;
    const char *name;
    uint32_t    value;
} access_t;

static access_t queue[256];
static unsigned first, last;

uint64_t mock_clock, mock_clock_step;

static void expect(char kind, const char *name, uint32_t value)
{
    REQUIRE(last < sizeof(queue) / sizeof(queue[0]));
    queue[last++] = (access_t){kind, name, value};
}

void expect_read(const char *name, uint32_t value)
{
    expect('r', name, value);
}

void expect_write(const char *name, uint32_t value)
{
    expect('w', name, value);
}

void expect_call(const char *name)
{
    expect('c', name, 0);
}

void require_all_done(void)
{
    if (first < last) {
        fprintf(stderr, "still expected: %c %s\n", queue[first].kind, queue[first].name);
    }
    REQUIRE(first == last);
    first = last = 0;
}

uint32_t mock_take(char kind, const char *name, uint32_t value)
{
    if (first == last || queue[first].kind != kind || strcmp(queue[first].name, name) != 0
        || (kind == 'w' && queue[first].value != value)) {
        fprintf(stderr, "%c %s 0x%x, but expected was %c %s 0x%x\n", kind, name, value,
            first < last ? queue[first].kind : '-', first < last ? queue[first].name : "nothing",
            first < last ? queue[first].value : 0);
        REQUIRE(!"the expected access");
    }
    return queue[first++].value;
}

#define READS(name)        uint32_t stereo_##name##_read(void) { return mock_take('r', #name, 0); }
#define WRITES(name, type) void stereo_##name##_write(type value) { mock_take('w', #name, value); }

READS(status)
READS(clocks)
READS(first_row_clocks)
READS(frames)
READS(version)
READS(max_width)
READS(max_disparities)
READS(block_sizes)
READS(max_prefilter_cap)
READS(features)
READS(dma_alignment)
READS(ev_pending)
READS(rows)
READS(rectification)
WRITES(left_base, uint32_t)
WRITES(right_base, uint32_t)
WRITES(disparity_base, uint32_t)
WRITES(width, uint16_t)
WRITES(height, uint16_t)
WRITES(disparities, uint16_t)
WRITES(block_size, uint8_t)
WRITES(min_disparity, uint8_t)
WRITES(prefilter_cap, uint8_t)
WRITES(texture_threshold, uint32_t)
WRITES(uniqueness_ratio, uint8_t)
WRITES(disp12_max_diff, uint8_t)
WRITES(options, uint8_t)
WRITES(control, uint8_t)
WRITES(left_out_base, uint32_t)
WRITES(right_out_base, uint32_t)
WRITES(place, uint32_t)
WRITES(node, uint32_t)
WRITES(grid0_size, uint32_t)
WRITES(grid1_size, uint32_t)
WRITES(ev_pending, uint32_t)
WRITES(ev_enable, uint32_t)

void memory_to_device(void)
{
    mock_take('c', "memory_to_device", 0);
}

void memory_from_device(void)
{
    mock_take('c', "memory_from_device", 0);
}

uint64_t clock_now(void)
{
    mock_clock += mock_clock_step;
    return mock_clock;
}
