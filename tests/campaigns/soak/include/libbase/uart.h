/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Replaces LiteX's header and the UART: output of the firmware goes to standard error, and there is no input. */

#ifndef SOAK_UART_H
#define SOAK_UART_H

#include <stdint.h>
#include <stdio.h>

#define UART_EV_TX 0x1
#define UART_EV_RX 0x2

static inline void    uart_ev_enable_write(uint32_t value)  { (void)value; }
static inline void    uart_ev_pending_write(uint32_t value) { (void)value; }
static inline uint8_t uart_rxempty_read(void)               { return 1; }
static inline uint8_t uart_rxfull_read(void)                { return 0; }
static inline uint8_t uart_txfull_read(void)                { return 0; }
static inline uint8_t uart_txempty_read(void)               { return 1; }
static inline uint8_t uart_rxtx_read(void)                  { return 0; }
static inline void    uart_rxtx_write(uint8_t value)        { fputc(value, stderr); }

#endif
