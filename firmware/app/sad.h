/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_APP_SAD_H
#define LITESTEREO_APP_SAD_H

#include <stdint.h>

/** Value of a pixel of the map that has no disparity. */
#define SAD_INVALID (-16)

/** Words that sad_match needs to work in. */
#define SAD_SCRATCH_WORDS(width, height) ((uint32_t)(width) * (height) + (width))

/** Disparity map of an image pair by the sum of absolute differences, on the CPU.
 *
 * The smallest cost wins, and of equal costs the largest disparity: bit for bit what the accelerator has to give.
 * Images and map are in raster order; the image is at least disparities + block_size - 1 wide and block_size high.
 * `scratch` has SAD_SCRATCH_WORDS(width, height) words.
 */
void sad_match(const uint8_t *left, const uint8_t *right, uint32_t width, uint32_t height, uint32_t disparities,
    uint32_t block_size, int16_t *map, uint32_t *scratch);

#endif
