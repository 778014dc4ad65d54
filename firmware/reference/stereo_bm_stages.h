/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The stages of stereo_bm that look at a whole image or at a whole row. */

#ifndef LITESTEREO_REFERENCE_STEREO_BM_STAGES_H
#define LITESTEREO_REFERENCE_STEREO_BM_STAGES_H

#include <stdint.h>

#include "litestereo/stereo_settings.h"

/** Horizontal Sobel filter, clipped to +-cap and shifted to 0 to 2 x cap: PREFILTER_XSOBEL. */
void prefilter_xsobel(const stereo_settings_t *settings, const uint8_t *image, uint8_t *filtered);

/** Words that left_right_check needs to work in. */
static inline uint32_t left_right_words(const stereo_settings_t *settings)
{
    return 2u * settings->width;
}

/** Left-right check of a row: makes invalid what others contradict.
 *
 * `disparity` and `cost` begin with column min_disparity + disparities - 1 and have `count` elements.
 */
void left_right_check(const stereo_settings_t *settings, int16_t *disparity, const uint32_t *cost, uint32_t count,
    uint32_t *scratch);

/** Words that median3x3 needs to work in. */
static inline uint32_t median_words(const stereo_settings_t *settings)
{
    return settings->width;
}

/** Median of each pixel and its eight neighbours, those beyond the edge being the outermost ones again, in place. */
void median3x3(const stereo_settings_t *settings, int16_t *map, uint32_t *scratch);

#endif
