/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The watchdog of the SoC, which resets it if the program hangs. In a SoC without one these functions do nothing. */

#ifndef LITESTEREO_WATCHDOG_H
#define LITESTEREO_WATCHDOG_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Starts the watchdog: feed it at least every `clocks` clocks from now on. If not, it raises an interrupt, in which
 * the program can record where it hangs, and resets the SoC a twentieth of a second later. */
void watchdog_start(uint32_t clocks);

/** Feeds the watchdog; does nothing while it is not running. */
void watchdog_feed(void);

/** Pauses the watchdog during an operation of unknown length. */
void watchdog_pause(void);

/** Feeds the watchdog and lets it continue; does nothing if it was never started. */
void watchdog_resume(void);

#ifdef __cplusplus
}
#endif

#endif
