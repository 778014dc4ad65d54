/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A scene under a light, as a sensor shows it: statistics of its image at an exposure and a gain. */

#ifndef SCENE_H
#define SCENE_H

#include "litestereo/exposure.h"

/** Patches of a scene, of different brightness. */
#define SCENE_PATCHES 64

/** A scene; the light is apart. */
typedef struct {
    double patches[SCENE_PATCHES]; /**< Brightness of each: 1 on average. */
} scene_t;

/** Kinds of scenes. */
enum { SCENE_FLAT, SCENE_GRADIENT, SCENE_CONTRAST, SCENE_HALF_BLACK, SCENE_SKY, SCENE_KINDS };

/** A scene of a kind. */
scene_t scene_of(int kind);

/** Its image: a value of 1 under a light of 1 at an exposure of one row and a gain of 1, in proportion; values
 * above 255 are 255, and each patch is 1000 pixels. */
image_statistics_t scene_image(const scene_t *scene, double light, double exposure, double gain);

/** Mean of an image. */
double scene_mean(const image_statistics_t *image);

#endif
