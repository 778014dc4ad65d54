/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Registers that expect accesses in an order that a test writes down beforehand. */

#ifndef MOCK_CSR_H
#define MOCK_CSR_H

#include <stdint.h>

/** The next access is a read of that register, and it yields `value`. */
void expect_read(const char *name, uint32_t value);

/** The next access is a write of `value` to that register. */
void expect_write(const char *name, uint32_t value);

/** The next access is the call of a function of the platform. */
void expect_call(const char *name);

/** All expected accesses have been made. */
void require_all_done(void);

/** An access: 'r' of a register, 'w' of a value to it, or 'c' of a function; returns the value that is read. */
uint32_t mock_take(char kind, const char *name, uint32_t value);

/** Time that clock_now() gives, and how much it goes on at each look. */
extern uint64_t mock_clock, mock_clock_step;

#endif
