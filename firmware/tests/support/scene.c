/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "scene.h"

#include "require.h"

#define PIXELS 1000u

scene_t scene_of(int kind)
{
    scene_t scene;
    double  sum = 0;

    for (int i = 0; i < SCENE_PATCHES; i++) {
        double *patch = &scene.patches[i];

        switch (kind) {
        case SCENE_FLAT:
            *patch = 1;
            break;
        case SCENE_GRADIENT:
            *patch = i + 1;
            break;
        case SCENE_CONTRAST:
            *patch = i % 8 == 0 ? 1 : 0.1 + i % 5 * 0.05;
            break;
        case SCENE_HALF_BLACK:
            *patch = i % 2;
            break;
        default:
            REQUIRE(kind == SCENE_SKY);
            *patch = i < 16 ? 10 : 1;
        }
        sum += *patch;
    }
    for (int i = 0; i < SCENE_PATCHES; i++) {
        scene.patches[i] *= SCENE_PATCHES / sum;
    }
    return scene;
}

image_statistics_t scene_image(const scene_t *scene, double light, double exposure, double gain)
{
    image_statistics_t image = {.pixels = PIXELS * SCENE_PATCHES};

    for (int i = 0; i < SCENE_PATCHES; i++) {
        double   exact = scene->patches[i] * light * exposure * gain;
        unsigned value = exact >= 255 ? 255 : (unsigned)exact;

        image.sum += value * PIXELS;
        image.dark += value < 6 ? PIXELS : 0;
        image.bright += value > 249 ? PIXELS : 0;
        image.bins[value / 16] += PIXELS;
    }
    return image;
}

double scene_mean(const image_statistics_t *image)
{
    return (double)image->sum / image->pixels;
}
