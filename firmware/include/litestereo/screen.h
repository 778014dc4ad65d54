/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the screen: gateware continuously shows a picture from memory. There are two pictures: one is drawn while
 * the other is shown. In a SoC without a screen these functions do nothing. */

#ifndef LITESTEREO_SCREEN_H
#define LITESTEREO_SCREEN_H

#include <stddef.h>
#include <stdint.h>

#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Handle of the screen; read-only for the caller. */
typedef struct {
    uint16_t width;     /**< Pixels, a multiple of 4; 0 if there is no screen. */
    uint16_t height;    /**< Pixels. */
    uint8_t *pictures;  /**< Both pictures, without a gap: a byte per pixel, 0 for black, in raster order. */
    uint8_t  hidden;    /**< Index of the picture that is not shown, 0 or 1. */
} screen_t;

/** Bytes of memory for both pictures; 0 if there is no screen. */
size_t screen_bytes(void);

/** Makes the screen black, and shows pictures in `memory` from now on: screen_bytes() bytes for the screen alone.
 *
 * STATUS_BAD_ARGUMENT if the memory is not aligned to 64 bytes or not in main RAM, STATUS_UNSUPPORTED if there is no
 * screen.
 */
status_t screen_init(screen_t *screen, uint8_t *memory);

/** The picture to draw, which is not shown: width x height bytes. Null if there is no screen. */
uint8_t *screen_hidden(const screen_t *screen);

/** Swaps the two pictures: shows the hidden one, and hides the other. */
void screen_show(screen_t *screen);

#ifdef __cplusplus
}
#endif

#endif
