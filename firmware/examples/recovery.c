/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Recovery from faults: the program fails in three ways, one after the other, and each start prints why. */

#include <stdint.h>

#include "litestereo/ensure.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/reset.h"
#include "litestereo/stereo.h"
#include "litestereo/watchdog.h"

static stereo_t stereo;
static serial_t serial;

static void handle_interrupt(void)
{
    stereo_isr(&stereo);
}

/* The watchdog was not fed: record where the program hangs. Without this handler the SoC is reset all the same. */
static void handle_watchdog(void)
{
    reset_now(RESET_WATCHDOG, platform_interrupted_at(), 0);
}

/* A wait without a bound. */
static __attribute__((noinline)) void hang(void)
{
    for (volatile bool forever = true; forever;) {
    }
}

int main(void)
{
    reset_report_t report;

    reset_begin(&report);
    serial_init(&serial);
    if (stereo_init(&stereo) != STATUS_OK) {
        print(&serial, "recovery: no matcher that this program knows\n");
        return 1;
    }
    platform_attach_stereo(handle_interrupt);
    platform_attach_watchdog(handle_watchdog);
    watchdog_start(clock_hz() / 10);
    /* As long as it is fed, nothing happens. */
    for (uint64_t begin = clock_now(); clock_now() - begin < clock_hz() / 2;) {
        watchdog_feed();
    }
    print(&serial, "recovery: start %u, %s, place 0x%08x, line %u, hang at 0x%08x\n", report.resets,
        reset_cause_name(report.cause), (unsigned)report.place, report.line, (unsigned)(uintptr_t)hang);
    switch (report.resets) {
    case 0:
        ENSURE(report.resets > 0);
        break;
    case 1:
        hang();
        break;
    case 2:
        /* The watchdog's interrupt is disabled: only its reset remains. */
        platform_attach_stereo(handle_interrupt);
        hang();
        break;
    default:
        watchdog_pause();
        print(&serial, "recovery: end\n");
        break;
    }
    return 0;
}
