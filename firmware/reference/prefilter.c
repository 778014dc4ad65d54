/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>

#include "stereo_bm_stages.h"

static int32_t smooth(const uint8_t *above, const uint8_t *here, const uint8_t *below, uint32_t column)
{
    return above[column] + 2 * here[column] + below[column];
}

void prefilter_xsobel(const stereo_settings_t *settings, const uint8_t *image, uint8_t *filtered)
{
    uint32_t width  = settings->width;
    uint32_t height = settings->height;
    int32_t  cap    = settings->prefilter_cap;

    for (uint32_t y = 0; y < height; y++) {
        const uint8_t *here  = image + y * width;
        const uint8_t *above = y > 0 ? here - width : here + width;
        const uint8_t *below = y + 1 < height ? here + width : here - width;
        uint8_t       *row   = filtered + y * width;

        memset(row, cap, width);
        /* OpenCV filters two rows at a time: with an odd height the last row keeps the constant value. */
        if (y + 1 == height && height % 2 == 1) {
            continue;
        }
        for (uint32_t x = 1; x + 1 < width; x++) {
            int32_t slope = smooth(above, here, below, x + 1) - smooth(above, here, below, x - 1);

            row[x] = (uint8_t)((slope < -cap ? -cap : slope > cap ? cap : slope) + cap);
        }
    }
}
