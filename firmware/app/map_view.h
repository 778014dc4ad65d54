/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Shows the map of the newest frame that is done on the screen, some pixels at a time. */

#ifndef LITESTEREO_APP_MAP_VIEW_H
#define LITESTEREO_APP_MAP_VIEW_H

#include "link/frame_pool.h"
#include "litestereo/screen.h"

/** The way from the frames to the screen. */
typedef struct {
    screen_t           *screen;  /**< The screen. */
    const frame_pool_t *pool;    /**< Where frames are done. */
    const frame_t      *frame;   /**< The slot of the map that is being drawn; null: none is. */
    uint32_t            order;   /**< Its frame's place in the line; or that of the frame before, modulo 2**32. */
    uint32_t            pitch;   /**< Its frame's pitch, in bytes, */
    stereo_settings_t   settings;  /**< and settings: the slot's may be another frame's by now. */
    uint32_t            row;     /**< Row of the picture that comes next. */
} map_view_t;

/** Begins with the screen as it is. */
void map_view_init(map_view_t *view, screen_t *screen, const frame_pool_t *pool);

/** Draws some of a map, if there is one to be drawn, and shows it when all of it is there; to be called often.
 *
 * No frame waits for it: a map that the next frame in its slot may overwrite is given up, and what was shown stays.
 * Without a screen it does nothing.
 */
void map_view_poll(map_view_t *view);

#endif
