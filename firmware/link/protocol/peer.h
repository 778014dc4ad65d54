/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The sender of a message. */

#ifndef LITESTEREO_LINK_PROTOCOL_PEER_H
#define LITESTEREO_LINK_PROTOCOL_PEER_H

#include <stdbool.h>
#include <stdint.h>

/** A UDP address and port; all zeros for the host at the serial line. */
typedef struct {
    bool     udp;      /**< Over UDP; else over the serial line. */
    uint16_t port;     /**< UDP port. */
    uint32_t address;  /**< IPv4 address; 192.168.1.50 is 0xc0a80132. */
} peer_t;

/** Whether two peers are the same. */
static inline bool peer_is(const peer_t *one, const peer_t *other)
{
    return one->udp == other->udp && one->port == other->port && one->address == other->address;
}

#endif
