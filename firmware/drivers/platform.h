/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The one place where LiteX's headers come in; tests put their own in the include path. */

#ifndef LITESTEREO_DRIVERS_PLATFORM_H
#define LITESTEREO_DRIVERS_PLATFORM_H

#include <generated/csr.h>
#include <generated/soc.h>
#include <libbase/uart.h>

#include "litestereo/platform.h"

/* Bytes that the UART's FIFOs hold: LiteX's default unless the SoC says more. */
#ifndef UART_RX_FIFO_DEPTH
#define UART_RX_FIFO_DEPTH 16
#endif
#ifndef UART_TX_FIFO_DEPTH
#define UART_TX_FIFO_DEPTH 16
#endif

#ifndef LITESTEREO_NAME
#define LITESTEREO_NAME "LiteStereo"
#endif

#endif
