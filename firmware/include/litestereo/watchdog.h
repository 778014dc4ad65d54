/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The watchdog of the SoC: resets it if the program does not come round. Without one these functions do nothing. */

#ifndef LITESTEREO_WATCHDOG_H
#define LITESTEREO_WATCHDOG_H

#include <stdint.h>

/** Starts it: it has to be fed every `clocks` clocks from now on. When it is not, its interrupt comes first, for the program
 * to say where it was, and a twentieth of a second later the reset. */
void watchdog_start(uint32_t clocks);

/** Feeds it; nothing happens while it is not running. */
void watchdog_feed(void);

/** Holds it for as long as something takes that nobody knows the length of. */
void watchdog_pause(void);

/** Lets it go on, fed; nothing happens if it was never started. */
void watchdog_resume(void);

#endif
