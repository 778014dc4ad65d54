/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A session with a serial line and a network, a matcher that is told when it ends, and memory that nobody may touch
 * around each slot. All that goes out is looked at. */

#ifndef SESSION_BENCH_H
#define SESSION_BENCH_H

#include "fuzz.h"
#include "link/serial_link.h"
#include "link/udp/udp_link.h"

/** Clocks of a second. */
#define HZ 1000000u

/** What is asked. */
extern session_t     session;
extern frame_pool_t  pool;
extern counters_t    counters;
extern serial_link_t line;
extern udp_link_t    udp;

/** The clock. */
extern uint64_t ticks;

/** Replies that went out on the serial line, and the last of them. */
extern unsigned  replies;
extern message_t reply;

/** Makes everything anew. */
void bench_reset(void);

/** Lets the firmware take a turn. */
void bench_turn(void);

/** Lets the matcher go on: begins the next frame, or ends the one that it has, well or not. */
void bench_match(bool well);

/** Looks at what always has to hold. */
void bench_check(void);

#endif
