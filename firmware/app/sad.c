/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "sad.h"

#include <stdbool.h>

/* The frame and the block, which all steps below need. */
typedef struct {
    const uint8_t *left;
    const uint8_t *right;
    uint32_t       width;
    uint32_t       height;
    uint32_t       first;  /* First column of the left image that has all disparities. */
    uint32_t       block;
    int16_t       *map;
    uint32_t      *best;    /* Smallest cost so far, one per pixel. */
    uint32_t      *column;  /* Running sum over the rows of the block, one per column. */
} pair_t;

/* Adds the absolute differences of a row to the column sums, or takes them away. */
static void add_row(const pair_t *pair, uint32_t row, uint32_t disparity, bool take_away)
{
    const uint8_t *left   = pair->left + row * pair->width;
    const uint8_t *right  = pair->right + row * pair->width - disparity;
    uint32_t      *column = pair->column;
    uint32_t       width  = pair->width;

    for (uint32_t x = pair->first; x < width; x++) {
        int32_t difference = left[x] - right[x];

        if ((difference < 0) != take_away) {
            difference = -difference;
        }
        column[x] += (uint32_t)difference;
    }
}

/* Sums columns up to the costs of one row of blocks, and keeps those that are smaller than the best so far. */
static void compare_row(const pair_t *pair, uint32_t row, uint32_t disparity)
{
    uint32_t        margin  = pair->block / 2;
    uint32_t       *best    = pair->best + row * pair->width;
    int16_t        *map     = pair->map + row * pair->width;
    const uint32_t *column  = pair->column + pair->first;
    const uint32_t *leaving = column;
    uint32_t        cost    = 0;

    for (uint32_t i = 0; i + 1 < pair->block; i++) {
        cost += *column++;
    }
    for (uint32_t x = pair->first + margin; x < pair->width - margin; x++) {
        cost += *column++;
        if (cost < best[x]) {
            best[x] = cost;
            map[x]  = (int16_t)(disparity * 16);
        }
        cost -= *leaving++;
    }
}

void sad_match(const uint8_t *left, const uint8_t *right, uint32_t width, uint32_t height, uint32_t disparities,
    uint32_t block_size, int16_t *map, uint32_t *scratch)
{
    pair_t pair = {left, right, width, height, disparities - 1, block_size, map, scratch, scratch + width * height};

    for (uint32_t pixel = 0; pixel < width * height; pixel++) {
        pair.best[pixel] = UINT32_MAX;
        map[pixel]        = SAD_INVALID;
    }
    /* From the largest disparity down, so that of equal costs the largest stays. */
    for (uint32_t disparity = disparities; disparity-- > 0;) {
        for (uint32_t x = 0; x < width; x++) {
            pair.column[x] = 0;
        }
        for (uint32_t row = 0; row < height; row++) {
            add_row(&pair, row, disparity, false);
            if (row >= block_size) {
                add_row(&pair, row - block_size, disparity, true);
            }
            if (row >= block_size - 1) {
                compare_row(&pair, row - block_size / 2, disparity);
            }
        }
    }
}
