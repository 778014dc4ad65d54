/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/exposure.h"

/* Factors are in 256ths. */
#define ONE   256u
#define MOST  (4 * ONE)
#define LEAST (ONE / 4)

/* No change between these factors. */
#define KEEP_LOW  (ONE * 7 / 8)
#define KEEP_HIGH (ONE * 9 / 8)

/* With more than 1/8 of the pixels saturated their mean says too little: the factors of the first step down, the
 * second, and all others. With more than half of them it is the last one at once. */
static const uint32_t bright_steps[] = {ONE * 3 / 4, ONE / 2, LEAST};

#define LAST_STEP 2

/* Values of a bin, and the brightest value that is not saturated. */
#define BIN_VALUES 16u
#define UNSATURATED 249u

/* A gain has so many significant bits. */
#define GAIN_BITS 5

uint16_t exposure_round_gain(uint32_t gain)
{
    unsigned shift = 0;

    while (gain >> shift >= 1u << GAIN_BITS) {
        shift++;
    }
    return (uint16_t)(gain >> shift << shift);
}

status_t exposure_check(const exposure_limits_t *limits, uint16_t exposure, uint16_t gain)
{
    bool good = exposure >= limits->least_exposure && exposure <= limits->most_exposure && gain >= limits->least_gain
        && gain <= limits->most_gain && gain == exposure_round_gain(gain);

    return good ? STATUS_OK : STATUS_BAD_ARGUMENT;
}

status_t exposure_init(exposure_t *control, const exposure_limits_t *limits, uint16_t exposure, uint16_t gain)
{
    /* In an empty range there is no value. */
    if (limits->least_exposure == 0 || limits->least_gain == 0
        || limits->least_gain != exposure_round_gain(limits->least_gain)
        || exposure_check(limits, exposure, gain) != STATUS_OK) {
        return STATUS_BAD_ARGUMENT;
    }
    *control = (exposure_t){.limits = *limits, .exposure = exposure, .gain = gain};
    return STATUS_OK;
}

status_t exposure_fix(exposure_t *control, uint16_t exposure, uint16_t gain)
{
    status_t status = exposure_check(&control->limits, exposure, gain);

    if (status == STATUS_OK) {
        control->exposure = exposure;
        control->gain     = gain;
        control->fixed    = true;
    }
    return status;
}

void exposure_release(exposure_t *control)
{
    /* The fixed values may be new. */
    control->wait  = EXPOSURE_DELAY;
    control->fixed = false;
}

/* Sums of both images: they count as one. */
typedef struct {
    uint64_t pixels, sum, dark, bright, bins[EXPOSURE_BINS];
} totals_t;

static totals_t add(const image_statistics_t *left, const image_statistics_t *right)
{
    totals_t totals = {
        .pixels = (uint64_t)left->pixels + right->pixels, .sum    = (uint64_t)left->sum + right->sum,
        .dark   = (uint64_t)left->dark + right->dark,     .bright = (uint64_t)left->bright + right->bright,
    };

    for (unsigned bin = 0; bin < EXPOSURE_BINS; bin++) {
        totals.bins[bin] = (uint64_t)left->bins[bin] + right->bins[bin];
    }
    return totals;
}

/* Largest factor with which at most 1/8 of the pixels become saturated. */
static uint32_t most_factor(const totals_t *totals)
{
    uint64_t above = 0;
    unsigned bins  = EXPOSURE_BINS;

    /* The brightest bin that may not be saturated is bins - 1. */
    while (bins > 1 && (above + totals->bins[bins - 1]) * 8 <= totals->pixels) {
        above += totals->bins[--bins];
    }
    return UNSATURATED * ONE / (bins * BIN_VALUES - 1);
}

static uint32_t clamp_factor(uint64_t factor)
{
    return factor > MOST ? MOST : factor < LEAST ? LEAST : (uint32_t)factor;
}

/* The factor of exposure times gain that brings the mean to its target. */
static uint32_t wanted_factor(exposure_t *control, const totals_t *totals)
{
    uint64_t factor = totals->sum == 0 ? MOST : EXPOSURE_TARGET * ONE * totals->pixels / totals->sum;
    uint32_t most   = most_factor(totals);

    if (totals->bright * 8 > totals->pixels) {
        uint32_t step = bright_steps[totals->bright * 2 > totals->pixels ? LAST_STEP : control->bright];

        control->bright += control->bright < LAST_STEP;
        return factor < step ? clamp_factor(factor) : step;
    }
    control->bright = 0;
    /* The mean of an image that is mostly black says that it is too dark, not how much. */
    if (factor > KEEP_HIGH && totals->dark * 2 > totals->pixels) {
        factor = MOST;
    }
    if (factor > ONE && factor > most) {
        factor = most > ONE ? most : ONE;
    }
    return clamp_factor(factor);
}

static uint16_t clamp(uint64_t value, uint16_t least, uint16_t most)
{
    return value < least ? least : value > most ? most : (uint16_t)value;
}

bool exposure_step(exposure_t *control, const image_statistics_t *left, const image_statistics_t *right)
{
    const exposure_limits_t *limits = &control->limits;
    totals_t                 totals = add(left, right);
    uint16_t                 exposure, gain;
    uint32_t                 factor;
    uint64_t                 product;

    if (control->fixed || totals.pixels == 0) {
        return false;
    }
    if (control->wait > 0) {
        control->wait--;
        return false;
    }
    factor = wanted_factor(control, &totals);
    if (factor >= KEEP_LOW && factor <= KEEP_HIGH) {
        return false;
    }
    product  = (uint64_t)control->exposure * control->gain * factor / ONE;
    exposure = clamp(product / limits->least_gain, limits->least_exposure, limits->most_exposure);
    gain     = exposure_round_gain(clamp(product / exposure, limits->least_gain, limits->most_gain));
    if (exposure == control->exposure && gain == control->gain) {
        return false;
    }
    control->exposure = exposure;
    control->gain     = gain;
    control->wait     = EXPOSURE_DELAY;
    return true;
}
