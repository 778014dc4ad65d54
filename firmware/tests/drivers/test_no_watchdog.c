/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the watchdog in a SoC that has none: no register of another device is touched in its place. */

#include "litestereo/watchdog.h"
#include "mock_csr.h"

int main(void)
{
    watchdog_start(5000);
    watchdog_feed();
    watchdog_pause();
    watchdog_resume();
    require_all_done();
    return 0;
}
