/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* From disparities to distances. */

#ifndef LITESTEREO_DEPTH_H
#define LITESTEREO_DEPTH_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/stereo_settings.h"

/** A rectified stereo camera. */
typedef struct {
    uint32_t focal_px16;   /**< Focal length in sixteenths of a pixel of the matched images. */
    uint32_t baseline_um;  /**< Distance between the cameras, micrometres. */
} stereo_camera_t;

/** Distance of an object at infinity. */
#define DEPTH_FAR UINT32_MAX

/** Disparity of a pixel of the map, sixteenths of a pixel. */
static inline int16_t disparity_at(const stereo_settings_t *settings, const int16_t *map, uint32_t column, uint32_t row)
{
    return map[row * settings->width + column];
}

/** Whether a value of the map is a disparity, and not the value of a pixel without one. */
static inline bool disparity_is_valid(const stereo_settings_t *settings, int16_t value)
{
    return value != stereo_settings_invalid(settings);
}

/** Distance along the optical axis for a disparity in sixteenths of a pixel; millimetres, rounded.
 *
 * DEPTH_FAR for a disparity of 0 or less, and for distances that do not fit in the result.
 */
static inline uint32_t depth_mm(const stereo_camera_t *camera, int16_t disparity)
{
    uint64_t step = 1000 * (uint64_t)(disparity > 0 ? disparity : 0);
    uint64_t mm   = step == 0 ? DEPTH_FAR : ((uint64_t)camera->focal_px16 * camera->baseline_um + step / 2) / step;

    return mm < DEPTH_FAR ? (uint32_t)mm : DEPTH_FAR;
}

#endif
