/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the screen: gateware shows a picture from memory for ever. There are two, so that the one that is drawn is not
 * the one that is shown. A SoC may be built without it: then nothing here does anything. */

#ifndef LITESTEREO_SCREEN_H
#define LITESTEREO_SCREEN_H

#include <stddef.h>
#include <stdint.h>

#include "litestereo/status.h"

/** Handle of the screen; its members are the driver's, to be read only. */
typedef struct {
    uint16_t width;     /**< Pixels, a multiple of 4; 0 if there is no screen. */
    uint16_t height;    /**< Pixels. */
    uint8_t *pictures;  /**< Both, one behind the other: a byte per pixel, 0 for black, in raster order. */
    uint8_t  hidden;    /**< The one that is not shown, 0 or 1. */
} screen_t;

/** Bytes of memory that both pictures take; 0 if there is no screen. */
size_t screen_bytes(void);

/** Makes the screen black, and has it show what is in `memory` from now on: screen_bytes() that nobody else uses.
 *
 * STATUS_BAD_ARGUMENT if the memory is not aligned to 64 bytes, STATUS_UNSUPPORTED if there is no screen.
 */
status_t screen_init(screen_t *screen, uint8_t *memory);

/** The picture that is not shown, to be drawn: width x height bytes. Null if there is no screen. */
uint8_t *screen_hidden(const screen_t *screen);

/** Shows the picture that was not shown, and hides the other one. */
void screen_show(screen_t *screen);

#endif
