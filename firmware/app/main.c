/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "app.h"
#include "litestereo/platform.h"

static app_t app;

static void handle_interrupt(void)
{
    stereo_isr(&app.stereo);
}

int main(void)
{
    if (app_init(&app) != STATUS_OK) {
        for (;;) {
        }
    }
    platform_attach_stereo(handle_interrupt);
    for (;;) {
        app_poll(&app);
    }
}
