/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Mock registers that expect accesses in the order that a test has listed. */

#ifndef MOCK_CSR_H
#define MOCK_CSR_H

#include <stdint.h>

/** Expects a read of this register, which yields `value`. */
void expect_read(const char *name, uint32_t value);

/** Expects a write of `value` to this register. */
void expect_write(const char *name, uint32_t value);

/** Expects a call of this function of the platform. */
void expect_call(const char *name);

/** Requires that all expected accesses have been made. */
void require_all_done(void);

/** An access: 'r' of a register, 'w' of a value to it, or 'c' of a function; returns the value that is read. */
uint32_t mock_take(char kind, const char *name, uint32_t value);

/** Time that clock_now() returns, and its step per call. */
extern uint64_t mock_clock, mock_clock_step;

#endif
