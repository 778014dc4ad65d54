/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/stereo_settings.h"

/* Range of a setting, its default, and its neutral value, which needs no optional stage if there is a choice. */
typedef struct {
    const char *name;
    int32_t     least;
    int32_t     most;
    int32_t     step;
    int32_t     usual;
    int32_t     neutral;
    uint32_t    feature;          /* Stage that all other values need. */
    uint32_t    neutral_feature;  /* Stage that the neutral value needs. */
} rule_t;

#define RULE(field, name, member, ...) [STEREO_FIELD_##field] = {#name, __VA_ARGS__},

static const rule_t rules[] = {
    [STEREO_FIELD_NONE]   = {.name = "none"},
    [STEREO_FIELD_LEFT]   = {.name = "left"},
    [STEREO_FIELD_RIGHT]  = {.name = "right"},
    [STEREO_FIELD_MAP]    = {.name = "map"},
    STEREO_SETTINGS_TABLE(RULE)
    [STEREO_FIELD_WIDTH]  = {.name = "width"},
    [STEREO_FIELD_HEIGHT] = {.name = "height"},
    [STEREO_FIELD_RECTIFIED] = {.name = "rectified"},
    [STEREO_FIELD_LEFT_OUT]  = {.name = "left_out"},
    [STEREO_FIELD_RIGHT_OUT] = {.name = "right_out"},
};

const char *stereo_field_name(stereo_field_t field)
{
    return rules[field].name;
}

const char *stereo_feature_name(unsigned bit)
{
    static const char *const names[LITESTEREO_FEATURES] = LITESTEREO_FEATURE_NAMES;

    return names[bit];
}

#define PUT(field, name, member, ...) \
    case STEREO_FIELD_##field: \
        settings->member = value; \
        break;

/* The value is in its range, so it fits the member. */
static void put(stereo_settings_t *settings, stereo_field_t field, int32_t value)
{
    switch (field) {
    STEREO_SETTINGS_TABLE(PUT)
    default:
        break;
    }
}

#define GET(field, name, member, ...) \
    case STEREO_FIELD_##field: \
        return (int32_t)settings->member;

int32_t stereo_settings_get(const stereo_settings_t *settings, stereo_field_t field)
{
    switch (field) {
    STEREO_SETTINGS_TABLE(GET)
    default:
        return 0;
    }
}

static bool is_in_range(const stereo_limits_t *limits, stereo_field_t field, int32_t value)
{
    const rule_t *rule = &rules[field];

    if (value < rule->least || value > rule->most || (value - rule->least) % rule->step != 0) {
        return false;
    }
    if (field == STEREO_FIELD_DISPARITIES) {
        return value <= limits->max_disparities;
    }
    if (field == STEREO_FIELD_BLOCK_SIZE) {
        return value >= limits->min_block_size && value <= limits->max_block_size;
    }
    if (field == STEREO_FIELD_PREFILTER_CAP && limits->max_prefilter_cap != 0) {
        return value <= limits->max_prefilter_cap;
    }
    return true;
}

static bool is_built(const stereo_limits_t *limits, stereo_field_t field, int32_t value)
{
    uint32_t needed = value == rules[field].neutral ? rules[field].neutral_feature : rules[field].feature;

    return (limits->features & needed) == needed;
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
    for (stereo_field_t field = STEREO_FIELD_FIRST; field <= STEREO_FIELD_LAST; field++) {
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

    for (stereo_field_t field = STEREO_FIELD_FIRST; field <= STEREO_FIELD_LAST; field++) {
        int32_t value = bare ? rules[field].neutral : rules[field].usual;

        /* A missing stage is switched off; of the two prefilter stages the only one is chosen. */
        if (!is_built(limits, field, value)) {
            value = bare ? rules[field].usual : rules[field].neutral;
        }
        put(&settings, field, value);
    }
    if (settings.disparities > limits->max_disparities) {
        settings.disparities = limits->max_disparities;
    }
    if (settings.block_size > limits->max_block_size) {
        settings.block_size = limits->max_block_size;
    }
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
