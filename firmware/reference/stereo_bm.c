/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "stereo_bm.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "stereo_bm_stages.h"

/* State of a frame being matched. The lanes of a column are a sum per disparity, the smallest first, then the
 * texture. */
typedef struct {
    const stereo_settings_t *settings;
    const uint8_t           *left;       /* Images to match: filtered, or grey values. */
    const uint8_t           *right;
    uint32_t                 margin;     /* Half a block. */
    uint32_t                 lanes;      /* Number of sums: one per disparity, and the texture. */
    uint32_t                 first;      /* First column of the left image that gets a cost. */
    uint32_t                 count;      /* Columns that get a cost. */
    uint32_t                 columns;    /* Columns covered by their blocks: a margin more on either side. */
    uint32_t                *sums;       /* Per column and lane: sum over the rows of the block. */
    uint32_t                *costs;      /* Per lane: sum over the block. */
    uint32_t                *best;       /* Per column of the row: cost of the winner. */
    int16_t                 *disparity;  /* Per column of the row: disparity of the winner. */
    uint32_t                *scratch;    /* Memory for the stages. */
} work_t;

static uint32_t clamp(int32_t value, int32_t most)
{
    return (uint32_t)(value < 0 ? 0 : value > most ? most : value);
}

static uint32_t words(uint32_t bytes)
{
    return (bytes + 3) / 4;
}

/* Lays out the arrays of a frame from `memory` on; returns the number of words. */
static uint32_t lay_out(work_t *work, const stereo_settings_t *settings, uint32_t *memory)
{
    uint32_t image  = settings->xsobel ? words((uint32_t)settings->width * settings->height) : 0;
    uint32_t checks = left_right_words(settings) > median_words(settings) ? left_right_words(settings)
                                                                          : median_words(settings);

    *work = (work_t){
        .settings = settings,
        .margin   = settings->block_size / 2u,
        .lanes    = settings->disparities + 1u,
        .first    = (uint32_t)settings->min_disparity + settings->disparities - 1,
        .left     = (uint8_t *)memory,
        .right    = (uint8_t *)(memory + image),
    };
    work->count     = settings->width - work->first;
    work->columns   = work->count + 2 * work->margin;
    work->sums      = memory + 2 * image;
    work->costs     = work->sums + work->columns * work->lanes;
    work->best      = work->costs + work->lanes;
    work->disparity = (int16_t *)(work->best + work->count);
    work->scratch   = work->best + work->count + words(2 * work->count);
    return (uint32_t)(work->scratch - memory) + checks;
}

uint32_t stereo_bm_scratch_words(const stereo_settings_t *settings)
{
    static uint32_t nowhere;
    work_t          work;

    return lay_out(&work, settings, &nowhere);
}

/* Adds the absolute differences of a row to the column sums, or subtracts them if `sign` is -1. */
static void add_row(const work_t *work, uint32_t row, int32_t sign)
{
    const stereo_settings_t *settings    = work->settings;
    uint32_t                 disparities = settings->disparities;
    const uint8_t           *left        = work->left + row * settings->width;
    const uint8_t           *right       = work->right + row * settings->width;
    uint32_t                *sums        = work->sums;

    for (uint32_t column = 0; column < work->columns; column++) {
        /* Columns beyond the edge repeat the last one, separately in either image. */
        int32_t        step  = (int32_t)column - (int32_t)work->margin;
        int32_t        pixel = left[clamp((int32_t)work->first + step, settings->width - 1)];
        const uint8_t *other = right + clamp(step, settings->width - disparities) + disparities - 1;

        for (uint32_t lane = 0; lane < disparities; lane++) {
            int32_t difference = pixel - *other--;

            *sums++ += (uint32_t)(sign * (difference < 0 ? -difference : difference));
        }
        *sums++ += (uint32_t)(sign * abs(pixel - settings->prefilter_cap));
    }
}

static uint32_t find_winner(const uint32_t *costs, uint32_t disparities)
{
    uint32_t winner = disparities - 1;

    /* From the largest disparity down, so that the largest wins among equal costs. */
    for (uint32_t lane = disparities - 1; lane-- > 0;) {
        if (costs[lane] < costs[winner]) {
            winner = lane;
        }
    }
    return winner;
}

static bool is_unique(const work_t *work, uint32_t winner)
{
    uint32_t best  = work->costs[winner];
    uint32_t limit = best + best * work->settings->uniqueness_ratio / 100;

    for (uint32_t lane = 0; lane < work->settings->disparities; lane++) {
        bool rival = lane + 1 < winner || lane > winner + 1;

        if (rival && work->costs[lane] <= limit) {
            return false;
        }
    }
    return true;
}

/* Offset in 1/256 pixel from the costs next to the winner's. */
static int32_t fraction(const work_t *work, uint32_t winner)
{
    int32_t below, above, gap, scale;

    if (!work->settings->subpixel || winner == 0 || winner + 1 == work->settings->disparities) {
        return 0;
    }
    below = (int32_t)work->costs[winner - 1];
    above = (int32_t)work->costs[winner + 1];
    gap   = below - above;
    scale = below + above - 2 * (int32_t)work->costs[winner] + abs(gap);
    return scale != 0 ? gap * 256 / scale : 0;
}

static int16_t test_winner(const work_t *work, uint32_t winner)
{
    const stereo_settings_t *settings = work->settings;

    if ((settings->xsobel && work->costs[settings->disparities] < settings->texture_threshold)
        || (settings->uniqueness_ratio != 0 && !is_unique(work, winner))) {
        return stereo_settings_invalid(settings);
    }
    return (int16_t)(((int32_t)(settings->min_disparity + winner) * 256 + fraction(work, winner) + 15) >> 4);
}

/* Computes the disparities of one row from the column sums. */
static void match_row(const work_t *work)
{
    uint32_t        lanes   = work->lanes;
    const uint32_t *newest  = work->sums;
    const uint32_t *leaving = work->sums;

    memset(work->costs, 0, lanes * sizeof(*work->costs));
    for (uint32_t column = 0; column < work->columns; column++) {
        bool     full = column >= work->settings->block_size;
        uint32_t winner;

        for (uint32_t lane = 0; lane < lanes; lane++) {
            work->costs[lane] += newest[lane] - (full ? leaving[lane] : 0);
        }
        newest  += lanes;
        leaving += full ? lanes : 0;
        if (column + 1 >= work->settings->block_size) {
            uint32_t i = column + 1 - work->settings->block_size;

            winner             = find_winner(work->costs, work->settings->disparities);
            work->best[i]      = work->costs[winner];
            work->disparity[i] = test_winner(work, winner);
        }
    }
    if (work->settings->disp12_max_diff >= 0) {
        left_right_check(work->settings, work->disparity, work->best, work->count, work->scratch);
    }
}

void stereo_bm(const stereo_settings_t *settings, const uint8_t *left, const uint8_t *right, int16_t *map,
    uint32_t *scratch)
{
    uint32_t width = settings->width;
    uint32_t block = settings->block_size;
    work_t   work;

    lay_out(&work, settings, scratch);
    if (settings->xsobel) {
        prefilter_xsobel(settings, left, (uint8_t *)(uintptr_t)work.left);
        prefilter_xsobel(settings, right, (uint8_t *)(uintptr_t)work.right);
    } else {
        work.left  = left;
        work.right = right;
    }
    for (uint32_t pixel = 0; pixel < width * settings->height; pixel++) {
        map[pixel] = stereo_settings_invalid(settings);
    }
    memset(work.sums, 0, work.columns * work.lanes * sizeof(*work.sums));
    for (uint32_t row = 0; row < settings->height; row++) {
        add_row(&work, row, 1);
        if (row >= block) {
            add_row(&work, row - block, -1);
        }
        if (row + 1 >= block) {
            match_row(&work);
            memcpy(map + (row - work.margin) * width + work.first + work.margin, work.disparity + work.margin,
                (work.count - 2 * work.margin) * sizeof(*map));
        }
    }
    if (settings->median) {
        median3x3(settings, map, work.scratch);
    }
}
