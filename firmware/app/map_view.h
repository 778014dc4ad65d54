/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Shows the map of the newest frame that is DONE on the screen, some pixels at a time. */

#ifndef LITESTEREO_APP_MAP_VIEW_H
#define LITESTEREO_APP_MAP_VIEW_H

#include "link/frame_pool.h"
#include "litestereo/screen.h"

/** State of the view. */
typedef struct {
    screen_t           *screen;  /**< The screen. */
    const frame_pool_t *pool;    /**< The frames. */
    const frame_t      *frame;   /**< Slot of the map being drawn; null for none. */
    uint32_t            order;   /**< Queue position of the frame drawn last, modulo 2**32. */
    uint32_t            pitch;   /**< Pitch of its frame in bytes; the slot may have another frame by now. */
    stereo_settings_t   settings;  /**< Settings of its frame. */
    uint32_t            row;     /**< Next row of the picture. */
} map_view_t;

/** Prepares the view; the screen stays as it is. */
void map_view_init(map_view_t *view, screen_t *screen, const frame_pool_t *pool);

/** Draws a part of the newest map, and shows the picture once it is complete; to be called often.
 *
 * Frames never wait for the view: a map that may be overwritten is abandoned, and the old picture stays. Without a
 * screen it does nothing.
 */
void map_view_poll(map_view_t *view);

#endif
