/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Draws a stereo pair, for programs without a camera: a wall with random texture, and boxes in front of it. */

#ifndef LITESTEREO_EXAMPLES_SCENE_H
#define LITESTEREO_EXAMPLES_SCENE_H

#include <stdint.h>
#include <string.h>

#include "litestereo/stereo_settings.h"

/** A box in the left image. */
typedef struct {
    uint16_t column, row, width, height;  /**< Pixels. */
    uint8_t  disparity;                   /**< Pixels, at most `column`. */
} scene_box_t;

/* Random texture for a row, so that every block has a unique match. */
static inline void scene_texture(uint8_t *pixels, uint32_t count, uint32_t *seed)
{
    for (uint32_t i = 0; i < count; i++) {
        *seed = *seed * 1664525u + 1013904223u;
        pixels[i] = (uint8_t)(*seed >> 24);
    }
}

/** Draws both images: a wall at `disparity` pixels, then the boxes, of which the last is in front. Advances `seed`. */
static inline void scene_fill(uint8_t *left, uint8_t *right, const stereo_settings_t *settings, uint8_t disparity,
    const scene_box_t *boxes, unsigned count, uint32_t *seed)
{
    uint32_t width = settings->width;

    for (uint32_t row = 0; row < settings->height; row++) {
        uint8_t *to_left  = left + row * width;
        uint8_t *to_right = right + row * width;

        /* In the right image everything is further left by its disparity. */
        scene_texture(to_right, width, seed);
        memcpy(to_left + disparity, to_right, width - disparity);
        scene_texture(to_left, disparity, seed);
        for (unsigned i = 0; i < count; i++) {
            const scene_box_t *box = &boxes[i];

            if (row - box->row < box->height) {
                scene_texture(to_left + box->column, box->width, seed);
                memcpy(to_right + box->column - box->disparity, to_left + box->column, box->width);
            }
        }
    }
}

#endif
