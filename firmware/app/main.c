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

/* Clocks for the link alone between two rounds of the main loop: less than a millisecond at the clock of any board. */
#define LINK_CLOCKS 40000u

static app_t app;

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
    if (app_init(&app) != STATUS_OK) {
        app_give_up();
    }
    platform_attach_stereo(handle_interrupt);
    platform_attach_watchdog(handle_watchdog);
    for (;;) {
        uint64_t began = clock_now();

        app_poll(&app);
        while (clock_now() - began < LINK_CLOCKS) {
            app_poll_link(&app);
        }
    }
}
