/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/stereo_settings.h"

#define DEFAULT_DISPARITIES 64
#define DEFAULT_BLOCK_SIZE  9

/* Range of a setting, its default, and its neutral value, which needs no optional stage. */
typedef struct {
    const char *name;
    int32_t     least;
    int32_t     most;
    int32_t     usual;
    int32_t     neutral;
    uint32_t    feature;  /* Stage that all other values need. */
} rule_t;

static const rule_t rules[] = {
    [STEREO_FIELD_NONE]              = {"none",              0,  0,       0,  0,  0},
    [STEREO_FIELD_LEFT]              = {"left",              0,  0,       0,  0,  0},
    [STEREO_FIELD_RIGHT]             = {"right",             0,  0,       0,  0,  0},
    [STEREO_FIELD_MAP]               = {"map",               0,  0,       0,  0,  0},
    [STEREO_FIELD_DISPARITIES]       = {"disparities",       16, 256,     64, 16, 0},
    [STEREO_FIELD_BLOCK_SIZE]        = {"block_size",        5,  255,     9,  9,  0},
    [STEREO_FIELD_MIN_DISPARITY]     = {"min_disparity",     0,  255,     0,  0,  STEREO_FEATURE_MIN_DISPARITY},
    [STEREO_FIELD_PREFILTER]         = {"prefilter",         0,  1,       1,  0,  STEREO_FEATURE_XSOBEL},
    [STEREO_FIELD_PREFILTER_CAP]     = {"prefilter_cap",     1,  63,      31, 31, 0},
    [STEREO_FIELD_TEXTURE_THRESHOLD] = {"texture_threshold", 0,  0xfffff, 10, 0,  STEREO_FEATURE_TEXTURE},
    [STEREO_FIELD_UNIQUENESS_RATIO]  = {"uniqueness_ratio",  0,  100,     15, 0,  STEREO_FEATURE_UNIQUENESS},
    [STEREO_FIELD_DISP12_MAX_DIFF]   = {"disp12_max_diff",   -1, 254,     -1, -1, STEREO_FEATURE_LEFT_RIGHT},
    [STEREO_FIELD_SUBPIXEL]          = {"subpixel",          0,  1,       1,  0,  STEREO_FEATURE_SUBPIXEL},
    [STEREO_FIELD_MEDIAN]            = {"median",            0,  1,       0,  0,  STEREO_FEATURE_MEDIAN},
    [STEREO_FIELD_WIDTH]             = {"width",             0,  0,       0,  0,  0},
    [STEREO_FIELD_HEIGHT]            = {"height",            0,  0,       0,  0,  0},
};

const char *stereo_field_name(stereo_field_t field)
{
    return rules[field].name;
}

const char *stereo_feature_name(unsigned bit)
{
    static const char *const names[STEREO_FEATURES] = {
        "xsobel", "raw", "texture", "uniqueness", "subpixel", "left_right", "min_disparity", "median",
    };

    return names[bit];
}

static void put(stereo_settings_t *settings, stereo_field_t field, int32_t value)
{
    switch (field) {
    case STEREO_FIELD_DISPARITIES:       settings->disparities       = (uint16_t)value; break;
    case STEREO_FIELD_BLOCK_SIZE:        settings->block_size        = (uint8_t)value;  break;
    case STEREO_FIELD_MIN_DISPARITY:     settings->min_disparity     = (uint8_t)value;  break;
    case STEREO_FIELD_PREFILTER:         settings->xsobel            = value != 0;      break;
    case STEREO_FIELD_PREFILTER_CAP:     settings->prefilter_cap     = (uint8_t)value;  break;
    case STEREO_FIELD_TEXTURE_THRESHOLD: settings->texture_threshold = (uint32_t)value; break;
    case STEREO_FIELD_UNIQUENESS_RATIO:  settings->uniqueness_ratio  = (uint8_t)value;  break;
    case STEREO_FIELD_DISP12_MAX_DIFF:   settings->disp12_max_diff   = (int16_t)value;  break;
    case STEREO_FIELD_SUBPIXEL:          settings->subpixel          = value != 0;      break;
    default:                             settings->median            = value != 0;      break;
    }
}

int32_t stereo_settings_get(const stereo_settings_t *settings, stereo_field_t field)
{
    switch (field) {
    case STEREO_FIELD_DISPARITIES:       return settings->disparities;
    case STEREO_FIELD_BLOCK_SIZE:        return settings->block_size;
    case STEREO_FIELD_MIN_DISPARITY:     return settings->min_disparity;
    case STEREO_FIELD_PREFILTER:         return settings->xsobel;
    case STEREO_FIELD_PREFILTER_CAP:     return settings->prefilter_cap;
    case STEREO_FIELD_TEXTURE_THRESHOLD: return (int32_t)settings->texture_threshold;
    case STEREO_FIELD_UNIQUENESS_RATIO:  return settings->uniqueness_ratio;
    case STEREO_FIELD_DISP12_MAX_DIFF:   return settings->disp12_max_diff;
    case STEREO_FIELD_SUBPIXEL:          return settings->subpixel;
    default:                             return settings->median;
    }
}

static bool is_in_range(const stereo_limits_t *limits, stereo_field_t field, int32_t value)
{
    if (value < rules[field].least || value > rules[field].most) {
        return false;
    }
    if (field == STEREO_FIELD_DISPARITIES) {
        return value <= limits->max_disparities && value % 16 == 0;
    }
    if (field == STEREO_FIELD_BLOCK_SIZE) {
        return value >= limits->min_block_size && value <= limits->max_block_size && value % 2 == 1;
    }
    return true;
}

static bool is_built(const stereo_limits_t *limits, stereo_field_t field, int32_t value)
{
    /* Both values of this setting need a stage, and the gateware may have only one of them. */
    if (field == STEREO_FIELD_PREFILTER && value == 0) {
        return (limits->features & STEREO_FEATURE_RAW) != 0;
    }
    return value == rules[field].neutral || rules[field].feature == 0 || (limits->features & rules[field].feature) != 0;
}

status_t stereo_settings_set(stereo_settings_t *settings, const stereo_limits_t *limits, stereo_field_t field,
    int32_t value)
{
    if (!is_in_range(limits, field, value)) {
        return STATUS_BAD_ARGUMENT;
    }
    if (!is_built(limits, field, value)) {
        return STATUS_UNSUPPORTED;
    }
    put(settings, field, value);
    return STATUS_OK;
}

stereo_field_t stereo_settings_check(const stereo_settings_t *settings, const stereo_limits_t *limits)
{
    for (stereo_field_t field = STEREO_FIELD_DISPARITIES; field <= STEREO_FIELD_MEDIAN; field++) {
        int32_t value = stereo_settings_get(settings, field);

        if (!is_in_range(limits, field, value) || !is_built(limits, field, value)) {
            return field;
        }
    }
    return STEREO_FIELD_NONE;
}

static stereo_settings_t fill(const stereo_limits_t *limits, bool bare)
{
    stereo_settings_t settings = {0};

    for (stereo_field_t field = STEREO_FIELD_DISPARITIES; field <= STEREO_FIELD_MEDIAN; field++) {
        int32_t value = bare ? rules[field].neutral : rules[field].usual;

        /* A missing stage is switched off; of the two prefilter stages the only one is chosen. */
        if (!is_built(limits, field, value)) {
            value = field == STEREO_FIELD_PREFILTER ? !value : rules[field].neutral;
        }
        put(&settings, field, value);
    }
    settings.disparities = limits->max_disparities < DEFAULT_DISPARITIES ? limits->max_disparities
                                                                         : DEFAULT_DISPARITIES;
    settings.block_size  = limits->max_block_size < DEFAULT_BLOCK_SIZE ? limits->max_block_size : DEFAULT_BLOCK_SIZE;
    return settings;
}

stereo_settings_t stereo_settings_default(const stereo_limits_t *limits)
{
    return fill(limits, false);
}

stereo_settings_t stereo_settings_bare(const stereo_limits_t *limits)
{
    return fill(limits, true);
}
