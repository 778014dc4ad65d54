/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the screen's gateware was told, behind the functions of the stub csr.h. */

#ifndef FAKE_SCREEN_H
#define FAKE_SCREEN_H

#include <stdint.h>

/** The one screen. */
typedef struct {
    uint32_t base;     /**< Address of the picture that is shown. */
    uint32_t enable;   /**< Whether one is. */
    unsigned shows;    /**< Bases that were written while it was. */
    unsigned off;      /**< Times that it was switched off. */
} fake_screen_t;

extern fake_screen_t fake_screen;

/** Pixel of the picture that is shown. */
uint8_t shown_pixel(unsigned column, unsigned row);

#endif
