/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A disparity map as a grey picture: what is near is bright. */

#ifndef LITESTEREO_GREY_MAP_H
#define LITESTEREO_GREY_MAP_H

#include <stdint.h>

#include "litestereo/stereo_settings.h"

/** Draws one row of a picture of `width` x `height` pixels: in its middle the map or, of a larger map, the map's middle.
 *
 * The largest disparity that is searched becomes 255, others in proportion, rounded; what is 0 or less, has no disparity, or
 * is not of the map becomes 0.
 *
 * @param settings  of the map
 * @param map       settings->width x settings->height int16, sixteenths of a pixel, in raster order
 * @param out       the row, `width` bytes
 * @param row       its number, 0 to `height` - 1
 * @return          how many pixels of it are the map's
 */
uint32_t grey_map_row(const stereo_settings_t *settings, const int16_t *map, uint8_t *out, uint32_t width,
    uint32_t height, uint32_t row);

#endif
