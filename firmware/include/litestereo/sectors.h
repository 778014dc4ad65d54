/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The nearest surface in each of several vertical sectors of the map. */

#ifndef LITESTEREO_SECTORS_H
#define LITESTEREO_SECTORS_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "litestereo/stereo_settings.h"

#ifdef __cplusplus
extern "C" {
#endif

/** One sector. */
typedef struct {
    uint16_t first;      /**< First column. */
    uint16_t columns;    /**< Number of columns. */
    uint32_t pixels;     /**< Pixels that have a disparity. */
    bool     found;      /**< At least `least` pixels have a disparity. */
    int16_t  disparity;  /**< If found: largest disparity that `least` pixels reach, sixteenths of a pixel. */
} sector_t;

/** Finds the nearest surface in each of `count` sectors.
 *
 * The sectors divide the columns that can have a disparity, so without the left part of the map. `least` is the number
 * of pixels that make a surface: fewer count as mismatches. Uses 1 KiB of stack, and reads the map twice.
 *
 * STATUS_BAD_ARGUMENT if `least` or `count` is 0, STATUS_SIZE if there are fewer such columns than sectors.
 */
status_t sectors_find(const stereo_settings_t *settings, const int16_t *map, uint32_t least, sector_t *sectors,
    unsigned count);

#ifdef __cplusplus
}
#endif

#endif
