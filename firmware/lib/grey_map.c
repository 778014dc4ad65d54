/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/grey_map.h"

#include <string.h>

/* Fractional bits of the scale: a pixel costs one multiplication, and no division. */
#define SCALE_BITS 16

static uint32_t smaller(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static void convert(const stereo_settings_t *settings, const int16_t *from, uint8_t *to, uint32_t pixels)
{
    int32_t largest = 16 * (settings->min_disparity + settings->disparities - 1);
    int32_t scale   = (255 << SCALE_BITS) / largest;
    int16_t invalid = stereo_settings_invalid(settings);

    for (uint32_t i = 0; i < pixels; i++) {
        int32_t disparity = from[i];

        if (disparity <= 0 || disparity == invalid) {
            to[i] = 0;
        } else if (disparity >= largest) {
            to[i] = 255;
        } else {
            to[i] = (uint8_t)((disparity * scale + (1 << (SCALE_BITS - 1))) >> SCALE_BITS);
        }
    }
}

uint32_t grey_map_row(const stereo_settings_t *settings, const int16_t *map, uint8_t *out, uint32_t width,
    uint32_t height, uint32_t row)
{
    uint32_t columns = smaller(width, settings->width);
    uint32_t rows    = smaller(height, settings->height);
    uint32_t before  = (width - columns) / 2;
    uint32_t above   = (height - rows) / 2;

    if (row < above || row - above >= rows) {
        memset(out, 0, width);
        return 0;
    }
    map += (row - above + (settings->height - rows) / 2) * settings->width + (settings->width - columns) / 2;
    memset(out, 0, before);
    convert(settings, map, out + before, columns);
    memset(out + before + columns, 0, width - before - columns);
    return columns;
}
