/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/watchdog.h"

#include "platform.h"

#define CONTROL_FEED   REGISTER_BIT(WATCHDOG0_CONTROL_FEED)
#define CONTROL_ENABLE REGISTER_BIT(WATCHDOG0_CONTROL_ENABLE)
#define CONTROL_RESET  REGISTER_BIT(WATCHDOG0_CONTROL_RESET)

void watchdog_start(uint32_t clocks)
{
    watchdog_pause();
    watchdog0_cycles_write(clocks);
    watchdog0_ev_pending_write(REGISTER_BIT(WATCHDOG0_EV_PENDING_WDT));
    watchdog0_ev_enable_write(REGISTER_BIT(WATCHDOG0_EV_ENABLE_WDT));
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
