/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

#include "stereo_bm_stages.h"

static int16_t median_of(const int16_t *values)
{
    int16_t sorted[9];

    for (unsigned i = 0; i < 9; i++) {
        unsigned place = i;

        for (; place > 0 && sorted[place - 1] > values[i]; place--) {
            sorted[place] = sorted[place - 1];
        }
        sorted[place] = values[i];
    }
    return sorted[4];
}

void median3x3(const stereo_settings_t *settings, int16_t *map, uint32_t *scratch)
{
    uint32_t width = settings->width;
    int16_t *above = (int16_t *)scratch;
    int16_t *here  = above + width;

    /* Copies of the original rows, which are overwritten. */
    memcpy(above, map, width * sizeof(*map));
    for (uint32_t y = 0; y < settings->height; y++) {
        int16_t       *row   = map + y * width;
        const int16_t *below = y + 1u < settings->height ? row + width : here;

        memcpy(here, row, width * sizeof(*map));
        for (uint32_t x = 0; x < width; x++) {
            uint32_t left  = x > 0 ? x - 1 : 0;
            uint32_t right = x + 1 < width ? x + 1 : x;

            row[x] = median_of((const int16_t[9]){
                above[left], above[x], above[right],
                here[left],  here[x],  here[right],
                below[left], below[x], below[right],
            });
        }
        memcpy(above, here, width * sizeof(*map));
    }
}
