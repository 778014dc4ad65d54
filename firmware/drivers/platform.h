/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* LiteX's headers for the drivers; tests put stubs in the include path. */

#ifndef LITESTEREO_DRIVERS_PLATFORM_H
#define LITESTEREO_DRIVERS_PLATFORM_H

#include <libbase/uart.h>

#include "litestereo/platform.h"
#include "registers.h"

/* Bytes that the UART's FIFOs hold: LiteX's default unless the SoC defines them. */
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
