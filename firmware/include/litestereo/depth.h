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

#ifdef __cplusplus
extern "C" {
#endif

/** Calibration of a rectified stereo camera, all of it for images of the size that is matched. */
typedef struct {
    uint32_t focal_px16;   /**< Focal length, sixteenths of a pixel. */
    uint32_t baseline_um;  /**< Distance between the cameras, micrometres. */
    /** Column of the principal point in the right image minus that in the left one, sixteenths of a pixel: `doffs` of
     * Middlebury's calib.txt. 0 if rectification has made them the same, as cv2.stereoRectify does with
     * CALIB_ZERO_DISPARITY. */
    int32_t  doffs_px16;
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

/** Distance along the optical axis, millimetres, rounded: focal length x baseline / (disparity + doffs).
 *
 * `disparity` is in sixteenths of a pixel, of a pixel for which disparity_is_valid: the value of the others gives a
 * distance like any other. DEPTH_FAR if disparity + doffs is 0 or less, and for distances that do not fit in the result.
 * 0 for distances below half a millimetre, and for a camera without focal length or baseline.
 */
static inline uint32_t depth_mm(const stereo_camera_t *camera, int16_t disparity)
{
    int64_t  shift   = (int64_t)disparity + camera->doffs_px16;
    uint64_t product = (uint64_t)camera->focal_px16 * camera->baseline_um;
    uint64_t step    = shift > 0 ? 1000 * (uint64_t)shift : 1;
    uint64_t rest    = product % step;
    /* Rounded by the rest: the product has no room for half a step more. */
    uint64_t mm      = product / step + (rest >= step - rest ? 1 : 0);

    return shift > 0 && mm < DEPTH_FAR ? (uint32_t)mm : DEPTH_FAR;
}

#ifdef __cplusplus
}
#endif

#endif
