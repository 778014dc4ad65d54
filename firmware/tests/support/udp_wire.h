/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A UDP socket of this computer as the wire of the fake frame link. */

#ifndef UDP_WIRE_H
#define UDP_WIRE_H

#include <stdint.h>

/** Listens on a port of 127.0.0.1, or on a free one if it is 0; returns the port, or 0 with errno set. */
uint16_t udp_wire_listen(uint16_t port);

/** The socket to wait for, or -1. */
int udp_wire_socket(void);

/** Passes received datagrams to the fake frame link, but not so many requests that its mailbox overflows. */
void udp_wire_receive(void);

#endif
