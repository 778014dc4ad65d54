/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A TCP port of this computer as the UART of the stub csr.h; serves one client at a time. */

#ifndef TCP_UART_H
#define TCP_UART_H

#include <stdbool.h>
#include <stdint.h>

/** Listens on a port of 127.0.0.1, or on a free one if it is 0; returns the port, or 0 with errno set. */
uint16_t tcp_uart_listen(uint16_t port);

/** Sleeps until a socket is ready, but not for long, because a match may end. Does not sleep
 * if the program is busy. Returns false once stopped.  */
bool tcp_uart_wait(int other, bool busy);

/** Ends all waits; may be called by a signal handler. */
void tcp_uart_stop(void);

/** Sends written bytes. */
void tcp_uart_flush(void);

/** Ends the connection, if there is one. */
void tcp_uart_hang_up(void);

#endif
