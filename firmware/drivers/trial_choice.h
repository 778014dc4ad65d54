/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The image that the boot program starts first. */

#ifndef LITESTEREO_DRIVERS_TRIAL_CHOICE_H
#define LITESTEREO_DRIVERS_TRIAL_CHOICE_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/trial.h"

/* Reads the record of the trial; returns false if there is none, or if it is about another image than the one in flash.
 * The flash must not be busy. */
bool trial_read(trial_record_t *record);

/* Index of the image to try first. `starts` is the number of starts on trial that were not confirmed: raised if this is
 * another one, else 0, but kept once it is TRIAL_STARTS. Returns whether the image is on trial in `on_trial`. */
uint32_t trial_choose(uint32_t *starts, bool *on_trial);

#endif
