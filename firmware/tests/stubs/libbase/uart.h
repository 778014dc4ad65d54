/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Replaces the header of LiteX's libbase. */

#ifndef STUB_LIBBASE_UART_H
#define STUB_LIBBASE_UART_H

#define UART_EV_TX 0x1
#define UART_EV_RX 0x2

#endif
