/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Platform of an example that is compiled for this computer: a matcher in software, and the UART on the standard
 * output. */

#include <stdio.h>

#include "fake_stereo.h"
#include "generated/csr.h"
#include "litestereo/platform.h"

static uint64_t now;

static uint64_t get_clock(void)
{
    return now;
}

uint64_t clock_now(void)
{
    fake_stereo.clock = get_clock;
    now += 100;
    fake_stereo_advance();
    return now;
}

void     memory_to_device(void)                { fake_stereo.clock = get_clock; }
void     memory_from_device(void)              {}
uint32_t uart_rxempty_read(void)               { return 1; }
uint32_t uart_rxfull_read(void)                { return 0; }
uint32_t uart_rxtx_read(void)                  { return 0; }
uint32_t uart_txempty_read(void)               { return 1; }
uint32_t uart_txfull_read(void)                { return 0; }
void     uart_ev_enable_write(uint32_t value)  { (void)value; }
void     uart_ev_pending_write(uint32_t value) { (void)value; }

void uart_rxtx_write(uint32_t value)
{
    putchar((int)value);
}
