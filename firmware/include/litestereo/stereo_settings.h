/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Settings of a frame, their ranges, and the gateware's limits. */

#ifndef LITESTEREO_STEREO_SETTINGS_H
#define LITESTEREO_STEREO_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "litestereo/stereo_tables.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Value of disp12_max_diff for no left-right check. */
#define STEREO_NO_CHECK (-1)

/** Limits of the settings: what the gateware was built for. */
typedef struct {
    uint16_t max_disparities;   /**< A multiple of 16. */
    uint8_t  min_block_size;    /**< Pixels, odd. */
    uint8_t  max_block_size;    /**< Pixels, odd. */
    uint32_t features;          /**< enum litestereo_feature. */
    uint8_t  max_prefilter_cap; /**< Largest prefilter_cap; 0: all of its range. */
} stereo_limits_t;

/** Settings of a frame: those of cv2.StereoBM, with its names, and a few more. */
typedef struct {
    uint16_t width;              /**< Pixels, at least stereo_settings_min_width(). */
    uint16_t height;             /**< Pixels, at least block_size. */
    uint16_t disparities;        /**< Number of disparities searched, a multiple of 16, at least 16. */
    uint8_t  block_size;         /**< Side of the block in pixels, odd. */
    uint8_t  min_disparity;      /**< Smallest disparity, pixels. */
    bool     xsobel;             /**< Prefilter XSOBEL; else grey values are matched, without texture test. */
    uint8_t  prefilter_cap;      /**< Largest slope that the prefilter keeps, 1 to 63. */
    uint32_t texture_threshold;  /**< Least texture of a block, up to 0xfffff. */
    uint8_t  uniqueness_ratio;   /**< Percent, 0 to 100; 0 for no test. */
    int16_t  disp12_max_diff;    /**< Largest difference in the left-right check, pixels, up to 254; -1 for no check. */
    bool     subpixel;           /**< Disparities in sixteenths of a pixel, or in whole pixels. */
    bool     median;             /**< Median of 3x3 pixels as the last step. */
} stereo_settings_t;

#define STEREO_FIELD_OF(field, ...) STEREO_FIELD_##field,

/** Fields of a job, for error messages. Those of STEREO_SETTINGS_TABLE are settings with a range. */
typedef enum {
    STEREO_FIELD_NONE,
    STEREO_FIELD_LEFT,
    STEREO_FIELD_RIGHT,
    STEREO_FIELD_MAP,
    STEREO_SETTINGS_TABLE(STEREO_FIELD_OF)
    STEREO_FIELD_WIDTH,
    STEREO_FIELD_HEIGHT,
    STEREO_FIELD_RECTIFIED,
    STEREO_FIELD_LEFT_OUT,
    STEREO_FIELD_RIGHT_OUT,
} stereo_field_t;

#undef STEREO_FIELD_OF

/** The first and the last of the settings with a range, in the order of the protocol's parameters. */
#define STEREO_FIELD_FIRST ((stereo_field_t)(STEREO_FIELD_MAP + 1))
#define STEREO_FIELD_LAST  ((stereo_field_t)(STEREO_FIELD_WIDTH - 1))

/** Name of a field for messages. */
const char *stereo_field_name(stereo_field_t field);

/** Name of a feature by its bit, 0 to LITESTEREO_FEATURES - 1. */
const char *stereo_feature_name(unsigned bit);

/** Defaults of cv2.StereoBM as far as the gateware has the stages; block size 9, width and height 0. */
stereo_settings_t stereo_settings_default(const stereo_limits_t *limits);

/** Sum of absolute differences without optional stages; with prefilter only if the gateware has nothing else. */
stereo_settings_t stereo_settings_bare(const stereo_limits_t *limits);

/** Value of a setting, FIRST to LAST. */
int32_t stereo_settings_get(const stereo_settings_t *settings, stereo_field_t field);

/** Changes a setting, FIRST to LAST.
 *
 * STATUS_OK           done
 * STATUS_BAD_ARGUMENT the value is out of its range
 * STATUS_UNSUPPORTED  the value is legal, but the gateware was not built for it
 */
status_t stereo_settings_set(stereo_settings_t *settings, const stereo_limits_t *limits, stereo_field_t field,
    int32_t value);

/** First setting, FIRST to LAST, that stereo_settings_set would refuse, or STEREO_FIELD_NONE. */
stereo_field_t stereo_settings_check(const stereo_settings_t *settings, const stereo_limits_t *limits);

/** Smallest width of an image in which a pixel can have a disparity. */
static inline uint32_t stereo_settings_min_width(const stereo_settings_t *settings)
{
    return (uint32_t)settings->min_disparity + settings->disparities + settings->block_size - 1;
}

/** Value of a pixel without a disparity, sixteenths of a pixel. */
static inline int16_t stereo_settings_invalid(const stereo_settings_t *settings)
{
    return (int16_t)((settings->min_disparity - 1) * 16);
}

#ifdef __cplusplus
}
#endif

#endif
