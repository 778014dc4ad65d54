/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Exposure and gain of a pair of sensors, from the statistics of their images: one value of each for both.
 *
 * exposure_step once per pair of images; if it returns true, write `exposure` and `gain` to both sensors in the
 * blanking after the frame (sensors_expose). Nothing here touches hardware. */

#ifndef LITESTEREO_EXPOSURE_H
#define LITESTEREO_EXPOSURE_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Mean of the images that is aimed at, of 255. */
#define EXPOSURE_TARGET 100u

/** Frames after a new value that still have the old one. */
#define EXPOSURE_DELAY 2u

#define EXPOSURE_BINS 16u

/** Statistics of an image, or of a window of it. */
typedef struct {
    uint32_t pixels;              /**< Pixels counted; 0 without an image. */
    uint32_t sum;                 /**< Sum of their values. */
    uint32_t dark;                /**< Pixels below 6. */
    uint32_t bright;              /**< Pixels above 249. */
    uint32_t bins[EXPOSURE_BINS]; /**< Pixels in each sixteenth of the range. */
} image_statistics_t;

/** Ranges of a sensor. */
typedef struct {
    uint16_t least_exposure; /**< Rows; not 0. */
    uint16_t most_exposure;  /**< Rows. */
    uint16_t least_gain;     /**< Sixteenths; not 0, and one that exposure_round_gain does not change. */
    uint16_t most_gain;      /**< Sixteenths. */
} exposure_limits_t;

/** The control of a pair of sensors; read-only for the caller. */
typedef struct {
    exposure_limits_t limits;
    uint16_t          exposure; /**< Rows. */
    uint16_t          gain;     /**< Sixteenths. */
    bool              fixed;    /**< The values are given by exposure_fix. */
    uint8_t           wait;     /**< Frames until the newest values show. */
    uint8_t           bright;   /**< Steps so far of images with too many bright pixels, 2 for more. */
} exposure_t;

/** The next smaller gain that all sensors have, or the same: a number of five bits, times a power of two. In sixteenths
 * that are the gains 1, 1 1/16, ... 1 15/16, 2, 2 1/8, ... 3 7/8, 4, 4 1/4 and so on. */
uint16_t exposure_round_gain(uint32_t gain);

/** STATUS_BAD_ARGUMENT if a value is out of range, or a gain that exposure_round_gain would change. */
status_t exposure_check(const exposure_limits_t *limits, uint16_t exposure, uint16_t gain);

/** Begins with automatic control, from these values. STATUS_BAD_ARGUMENT if exposure_check refuses them, or a
 * limit is not as described; the control is as before then. */
status_t exposure_init(exposure_t *control, const exposure_limits_t *limits, uint16_t exposure, uint16_t gain);

/** Uses these values, and has exposure_step change nothing. STATUS_BAD_ARGUMENT if exposure_check refuses them. */
status_t exposure_fix(exposure_t *control, uint16_t exposure, uint16_t gain);

/** Automatic control again, from the present values. */
void exposure_release(exposure_t *control);

/** Takes the statistics of the next pair of images; returns whether `exposure` or `gain` has changed.
 *
 * A step is a factor of four at most. Exposure goes before gain: gain is above its least value only as far as
 * exposure in whole rows cannot reach the wanted product. Changes below an eighth are not made, and after each
 * change the images that still have the old values are not judged. At most an eighth of the pixels becomes brighter
 * than 249. Values at a limit stay there. Without pixels nothing changes, and with the images of one sensor alone
 * they count for both.
 */
bool exposure_step(exposure_t *control, const image_statistics_t *left, const image_statistics_t *right);

#ifdef __cplusplus
}
#endif

#endif
