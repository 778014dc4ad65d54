/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The choice of the image to start. */

#ifndef START_H
#define START_H

#include <stdint.h>

/* Loads the firmware to start to memory; returns the index of its image, FLASH_IMAGES if there is none.
 *
 * The images are tried in the order of trial_choose. If the firmware is on trial its start is counted, and the watchdog
 * runs from then on: a firmware that hangs at once is reset like one that crashes. */
uint32_t start_load(void *memory);

#endif
