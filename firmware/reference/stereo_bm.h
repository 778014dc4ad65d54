/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The reference matcher in C, for the CPU: the accelerator's map must equal its map bit for bit. */

#ifndef LITESTEREO_REFERENCE_STEREO_BM_H
#define LITESTEREO_REFERENCE_STEREO_BM_H

#include <stdint.h>

#include "litestereo/stereo_settings.h"

/** Words of scratch memory for stereo_bm. */
uint32_t stereo_bm_scratch_words(const stereo_settings_t *settings);

/** Computes the disparity map of an image pair, as cv2.StereoBM does.
 *
 * Images and map are in raster order, width x height of `settings`, which are legal: see stereo_settings_t. `scratch`
 * has stereo_bm_scratch_words() words.
 */
void stereo_bm(const stereo_settings_t *settings, const uint8_t *left, const uint8_t *right, int16_t *map,
    uint32_t *scratch);

#endif
