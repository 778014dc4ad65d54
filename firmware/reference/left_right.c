/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdlib.h>

#include "stereo_bm_stages.h"

/* Per column of the right image: the cheapest of the disparities that point to it. */
typedef struct {
    const stereo_settings_t *settings;
    uint32_t                *cost;
    int32_t                 *disparity;
    int32_t                  invalid;
} votes_t;

static void vote(const votes_t *votes, uint32_t x, int32_t disparity, uint32_t cost)
{
    uint32_t column = x - (uint32_t)((disparity + 8) >> 4);

    if (disparity > votes->invalid && cost < votes->cost[column]) {
        votes->cost[column]      = cost;
        votes->disparity[column] = disparity;
    }
}

/* Whether a column holds a disparity that differs by more than disp12_max_diff. */
static bool differs(const votes_t *votes, uint32_t column, int32_t disparity)
{
    int32_t held = votes->disparity[column];

    return held > votes->invalid && abs(held - disparity) > 16 * votes->settings->disp12_max_diff;
}

void left_right_check(const stereo_settings_t *settings, int16_t *disparity, const uint32_t *cost, uint32_t count,
    uint32_t *scratch)
{
    uint32_t first = (uint32_t)settings->min_disparity + settings->disparities - 1;
    votes_t  votes = {
        .settings  = settings,
        .cost      = scratch,
        .disparity = (int32_t *)scratch + settings->width,
        .invalid   = stereo_settings_invalid(settings),
    };

    for (uint32_t x = 0; x < settings->width; x++) {
        votes.cost[x]      = UINT32_MAX;
        votes.disparity[x] = votes.invalid;
    }
    /* The first column neither votes nor is checked, as in OpenCV. */
    for (uint32_t i = 1; i < count; i++) {
        vote(&votes, first + i, disparity[i], cost[i]);
    }
    for (uint32_t i = 1; i < count; i++) {
        uint32_t x = first + i;

        if (disparity[i] > votes.invalid && differs(&votes, x - (uint32_t)(disparity[i] >> 4), disparity[i])
            && differs(&votes, x - (uint32_t)((disparity[i] + 15) >> 4), disparity[i])) {
            disparity[i] = (int16_t)votes.invalid;
        }
    }
}
