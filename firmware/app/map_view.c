/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "map_view.h"

#include <stddef.h>

#include "litestereo/grey_map.h"

/* Pixels drawn per poll, while bytes of the serial line wait. Four black pixels beside the map count as one. */
#define PIXELS_PER_POLL 640u

void map_view_init(map_view_t *view, screen_t *screen, const frame_pool_t *pool)
{
    *view = (map_view_t){.screen = screen, .pool = pool, .order = pool->next_order - 1};
}

/* Of the frames that are DONE the one queued last; null if none is newer than the last one drawn. */
static const frame_t *newest(const map_view_t *view)
{
    const frame_t *found = NULL;
    uint32_t       order = view->order;

    for (unsigned slot = 0; slot < view->pool->slots; slot++) {
        const frame_t *frame = &view->pool->frame[slot];

        if (frame->state == FRAME_DONE && (int32_t)(frame->order - order) > 0) {
            found = frame;
            order = frame->order;
        }
    }
    return found;
}

static void begin(map_view_t *view)
{
    view->frame = newest(view);
    view->row   = 0;
    if (view->frame != NULL) {
        view->order    = view->frame->order;
        view->pitch    = view->frame->pitch;
        view->settings = view->frame->settings;
    }
}

/* Whether the map being drawn is intact. The map of a released frame stays in its slot until the next frame there is
 * queued, unless that frame's images are of another size and overwrite it before. */
static bool is_intact(const map_view_t *view)
{
    return view->frame->order == view->order && view->frame->pitch == view->pitch;
}

static void draw(map_view_t *view)
{
    const screen_t *screen  = view->screen;
    const int16_t  *map     = (const int16_t *)(const void *)frame_map(view->frame);
    uint8_t        *picture = screen_hidden(screen);

    for (uint32_t done = 0; done < PIXELS_PER_POLL && view->row < screen->height; view->row++) {
        uint32_t pixels = grey_map_row(&view->settings, map, picture + view->row * screen->width, screen->width,
            screen->height, view->row);

        done += pixels + (screen->width - pixels) / 4;
    }
}

void map_view_poll(map_view_t *view)
{
    if (view->screen->width == 0) {
        return;
    }
    if (view->frame == NULL) {
        begin(view);
    } else if (!is_intact(view)) {
        view->frame = NULL;
    }
    if (view->frame != NULL) {
        draw(view);
        if (view->row == view->screen->height) {
            screen_show(view->screen);
            view->frame = NULL;
        }
    }
}
