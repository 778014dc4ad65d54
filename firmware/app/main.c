/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "app.h"

#include <stdio.h>

#include "litestereo/platform.h"
#include "litestereo/watchdog.h"

/* A round of the main loop takes milliseconds; its longest wait is for a stalled serial line. */
#define WATCHDOG_S 5u

static app_t app FAST_DATA;
static app_buffers_t buffers;

static void handle_interrupt(void)
{
    stereo_isr(&app.stereo);
}

static void handle_watchdog(void)
{
    uint32_t place = platform_interrupted_at();
    char     text[60];

    snprintf(text, sizeof(text), "\r\nwatchdog: stuck at 0x%08x, reset\r\n", (unsigned)place);
    serial_say(text);
    reset_now(RESET_WATCHDOG, place, 0);
}

int main(void)
{
    platform_stack_mark();
    /* Its interrupt is not handled yet, but its reset ends a hang of the start. */
    watchdog_start(WATCHDOG_S * clock_hz());
    if (app_init(&app, &buffers) != STATUS_OK) {
        app_give_up();
    }
    platform_attach_stereo(handle_interrupt);
    platform_attach_watchdog(handle_watchdog);
    for (;;) {
        app_poll(&app);
    }
}
