/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/watchdog.h"

#include "platform.h"

#define CONTROL_FEED   (1u << 0)
#define CONTROL_ENABLE (1u << 8)
#define CONTROL_RESET  (1u << 16)

#ifdef CSR_WATCHDOG0_BASE

void watchdog_start(uint32_t clocks)
{
    watchdog_pause();
    watchdog0_cycles_write(clocks);
    watchdog0_ev_pending_write(1);
    watchdog0_ev_enable_write(1);
    watchdog_resume();
}

void watchdog_feed(void)
{
    if ((watchdog0_control_read() & CONTROL_ENABLE) != 0) {
        watchdog0_control_write(CONTROL_FEED | CONTROL_ENABLE | CONTROL_RESET);
    }
}

void watchdog_pause(void)
{
    watchdog0_control_write(0);
}

void watchdog_resume(void)
{
    /* Feed and enable in one write: a watchdog that was never fed expires at once. */
    if (watchdog0_cycles_read() != 0) {
        watchdog0_control_write(CONTROL_FEED | CONTROL_ENABLE | CONTROL_RESET);
    }
}

#else

void watchdog_start(uint32_t clocks)
{
    (void)clocks;
}

void watchdog_feed(void)
{
}

void watchdog_pause(void)
{
}

void watchdog_resume(void)
{
}

#endif
