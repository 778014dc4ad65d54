/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A disparity map as a grey picture: near is bright. */

#ifndef LITESTEREO_GREY_MAP_H
#define LITESTEREO_GREY_MAP_H

#include <stdint.h>

#include "litestereo/stereo_settings.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Draws one row of a picture of `width` x `height` pixels, with the map centred in it, or cropped if it is larger.
 *
 * The largest disparity searched becomes 255, others in proportion, rounded. Disparities of 0 or less, pixels without
 * one, and pixels outside of the map become 0.
 *
 * @param settings  of the map
 * @param map       settings->width x settings->height int16, sixteenths of a pixel, in raster order
 * @param out       the row, `width` bytes
 * @param row       its number, 0 to `height` - 1
 * @return          the number of its pixels that are inside the map
 */
uint32_t grey_map_row(const stereo_settings_t *settings, const int16_t *map, uint8_t *out, uint32_t width,
    uint32_t height, uint32_t row);

#ifdef __cplusplus
}
#endif

#endif
