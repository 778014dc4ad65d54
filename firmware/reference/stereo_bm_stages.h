/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The stages of stereo_bm that work on a whole image or a whole row. */

#ifndef LITESTEREO_REFERENCE_STEREO_BM_STAGES_H
#define LITESTEREO_REFERENCE_STEREO_BM_STAGES_H

#include <stdint.h>

#include "litestereo/stereo_settings.h"

/** Horizontal Sobel filter, clipped to +-cap and shifted to 0 to 2 x cap: PREFILTER_XSOBEL. */
void prefilter_xsobel(const stereo_settings_t *settings, const uint8_t *image, uint8_t *filtered);

/** Words of scratch memory for left_right_check. */
static inline uint32_t left_right_words(const stereo_settings_t *settings)
{
    return 2u * settings->width;
}

/** Left-right check of a row: invalidates disparities that the right image contradicts.
 *
 * `disparity` and `cost` begin with column min_disparity + disparities - 1 and have `count` elements.
 */
void left_right_check(const stereo_settings_t *settings, int16_t *disparity, const uint32_t *cost, uint32_t count,
    uint32_t *scratch);

/** Words of scratch memory for median3x3. */
static inline uint32_t median_words(const stereo_settings_t *settings)
{
    return settings->width;
}

/** Median of each pixel and its eight neighbours, in place. Pixels beyond the edge repeat the outermost ones. */
void median3x3(const stereo_settings_t *settings, int16_t *map, uint32_t *scratch);

#endif
