/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "sad.h"

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

static uint32_t difference(const pair_t *pair, uint32_t row, uint32_t x, uint32_t disparity)
{
    uint32_t at = row * pair->width + x;
    uint32_t a  = pair->left[at];
    uint32_t b  = pair->right[at - disparity];

    return a > b ? a - b : b - a;
}

/* Moves the column sums down to the block whose last row is `row`. */
static void add_row(const pair_t *pair, uint32_t row, uint32_t disparity)
{
    for (uint32_t x = pair->first; x < pair->width; x++) {
        pair->column[x] += difference(pair, row, x, disparity);
        if (row >= pair->block) {
            pair->column[x] -= difference(pair, row - pair->block, x, disparity);
        }
    }
}

/* Sums columns up to the costs of one row of blocks, and keeps those that are smaller than the best so far. */
static void compare_row(const pair_t *pair, uint32_t row, uint32_t disparity)
{
    uint32_t margin = pair->block / 2;
    uint32_t offset = (row - margin) * pair->width;
    uint32_t cost   = 0;

    for (uint32_t x = pair->first; x < pair->width; x++) {
        uint32_t centre = offset + x - margin;

        cost += pair->column[x];
        if (x - pair->first < pair->block - 1) {
            continue;
        }
        if (cost < pair->best[centre]) {
            pair->best[centre] = cost;
            pair->map[centre]  = (int16_t)(disparity * 16);
        }
        cost -= pair->column[x - (pair->block - 1)];
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
            add_row(&pair, row, disparity);
            if (row >= block_size - 1) {
                compare_row(&pair, row, disparity);
            }
        }
    }
}
