/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The screen's registers, as functions of the stub csr.h. */

#ifndef FAKE_SCREEN_H
#define FAKE_SCREEN_H

#include <stdint.h>

/** The only screen. */
typedef struct {
    uint32_t base;     /**< Address of the picture that is shown. */
    uint32_t enable;   /**< Whether a picture is shown. */
    unsigned shows;    /**< Writes of the base while it was enabled. */
    unsigned off;      /**< Times that it was disabled. */
} fake_screen_t;

extern fake_screen_t fake_screen;

/** A pixel of the picture that is shown. */
uint8_t shown_pixel(unsigned column, unsigned row);

#endif
