/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A firmware that starts, feeds the watchdog, and crashes after a second; for the trial on the full system. */

#include "litestereo/ensure.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/reset.h"
#include "litestereo/serial.h"
#include "litestereo/watchdog.h"

static serial_t serial;

int main(void)
{
    reset_report_t report;

    watchdog_start(2 * clock_hz());
    reset_begin(&report);
    serial_init(&serial);
    print(&serial, "crash: started after %s\n", reset_cause_name(report.cause));
    for (uint64_t began = clock_now(); clock_now() - began < clock_hz();) {
        watchdog_feed();
    }
    ENSURE(report.image == 0);
    return 0;
}
