/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * litex_sim module: the screen of the simulated SoC as the file screen.ppm in the simulator's working folder. Each
 * complete picture replaces the previous one; its comment has the count of pictures, and what a monitor measures: pixel
 * clocks from one vertical sync to the next, and horizontal syncs in between. If a picture waited for the memory, its
 * rows are longer: a message reports that.
 */

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "error.h"
#include "modules.h"
#include "../pads.h"

#define PICTURE     "screen.ppm"
#define UNFINISHED  PICTURE ".new"
#define MOST_PIXELS (1920 * 1080)

struct session {
    char *clk, *de, *hsync, *vsync, *r, *g, *b;
    bool was_clk, was_de, was_hsync, was_vsync;
    unsigned pictures;
    /* State of the current picture. */
    unsigned clocks, syncs;
    unsigned rows, width, pixels;
    bool ragged; /* its rows are not all of one width */
    uint8_t rgb[3 * MOST_PIXELS];
};

static int start(void *base)
{
    (void)base;
    return RC_OK;
}

static int new_session(void **out, char *args)
{
    (void)args;
    *out = calloc(1, sizeof(struct session));
    return *out ? RC_OK : RC_NOENMEM;
}

static int add_pads(void *state, struct pad_list_s *list)
{
    struct session *session = state;

    if (!strcmp(list->name, "video")) {
        session->clk = pad(list, "clk");
        session->de = pad(list, "de");
        session->hsync = pad(list, "hsync");
        session->vsync = pad(list, "vsync");
        session->r = pad(list, "r");
        session->g = pad(list, "g");
        session->b = pad(list, "b");
    }
    return RC_OK;
}

static void write_picture(const struct session *session)
{
    FILE *file = fopen(UNFINISHED, "wb");
    bool failed = !file;

    if (file) {
        fprintf(file, "P6\n# picture %u, %u clocks, %u lines\n%u %u\n255\n", session->pictures, session->clocks,
                session->syncs, session->width, session->rows);
        failed = fwrite(session->rgb, 3, session->pixels, file) != session->pixels;
        failed |= fclose(file) != 0;
    }
    if (failed || rename(UNFINISHED, PICTURE)) {
        /* A test would mistake the previous picture for the latest. */
        perror("[video2file] cannot write " PICTURE);
        exit(1);
    }
}

static void end_row(struct session *session)
{
    unsigned width;

    session->rows++;
    width = session->pixels - (session->rows - 1) * session->width;
    if (session->rows == 1) {
        session->width = width;
    }
    session->ragged |= width != session->width;
}

static void end_picture(struct session *session)
{
    if (session->pixels) {
        session->pictures++;
        if (session->ragged) {
            printf("[video2file] picture %u has rows of more than one width\n", session->pictures);
            fflush(stdout);
        } else {
            write_picture(session);
        }
    }
    session->clocks = session->syncs = session->rows = session->width = session->pixels = 0;
    session->ragged = false;
}

static void take_pixel(struct session *session)
{
    uint8_t *rgb = session->rgb + 3 * session->pixels;

    if (session->pixels == MOST_PIXELS) {
        session->ragged = true;
        return;
    }
    session->pixels++;
    rgb[0] = (uint8_t)*session->r;
    rgb[1] = (uint8_t)*session->g;
    rgb[2] = (uint8_t)*session->b;
}

/* Return whether a signal has risen since the last sample. */
static bool rises(bool *was, const char *signal)
{
    bool before = *was;

    *was = *signal;
    return *was && !before;
}

static int tick(void *state, uint64_t time_ps)
{
    struct session *session = state;

    (void)time_ps;
    if (!rises(&session->was_clk, session->clk)) {
        return RC_OK;
    }
    if (*session->de) {
        take_pixel(session);
    } else if (session->was_de) {
        end_row(session);
    }
    session->was_de = *session->de;
    if (rises(&session->was_vsync, session->vsync)) {
        end_picture(session);
    }
    session->clocks++;
    session->syncs += rises(&session->was_hsync, session->hsync);
    return RC_OK;
}

static struct ext_module_s module = {
    .name = "video2file",
    .start = start,
    .new_sess = new_session,
    .add_pads = add_pads,
    .tick = tick,
};

int litex_sim_ext_module_init(int (*register_module)(struct ext_module_s *))
{
    return register_module(&module);
}
