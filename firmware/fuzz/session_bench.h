/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A session with a serial line and a network, a matcher that ends on command, and memory that must not be touched
 * around each slot. Everything that is sent is checked. */

#ifndef SESSION_BENCH_H
#define SESSION_BENCH_H

#include "fuzz.h"
#include "link/serial_link.h"
#include "link/udp/udp_link.h"

/** Clocks per second. */
#define HZ 1000000u

/** The session under test. */
extern session_t     session;
extern frame_pool_t  pool;
extern counters_t    counters;
extern serial_link_t line;
extern udp_link_t    udp;

/** The clock. */
extern uint64_t ticks;

/** Number of replies sent on the serial line, and the last of them. */
extern unsigned  replies;
extern message_t reply;

/** Resets everything. */
void bench_reset(void);

/** Polls the firmware once. */
void bench_poll(void);

/** Advances the matcher: begins the next frame, or ends the current one, with or without an error. */
void bench_match(bool well);

/** Checks the invariants. */
void bench_check(void);

#endif
