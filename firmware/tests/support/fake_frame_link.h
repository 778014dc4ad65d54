/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The frame link's gateware in software, as functions of the stub csr.h. */

#ifndef FAKE_FRAME_LINK_H
#define FAKE_FRAME_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/peer.h"

/** Configuration; set it before the firmware starts. */
typedef struct {
    uint16_t version;     /**< 0, the default, if there is no frame link. */
    uint16_t max_chunks;  /**< A multiple of 32. */
    uint16_t port;        /**< UDP. */
    bool     streaming;   /**< Streaming is built. */
    unsigned skips;       /**< One in this many parts of streamed maps, at random, is never sent; 0 for none. */
    bool     hang;        /**< No operation ends, and no pairs are accepted. */
    bool   (*matching)(void);  /**< Whether the matcher is busy; may be null. */
    /** Sends a datagram; false if it cannot yet. */
    bool   (*send)(const peer_t *peer, const uint8_t *bytes, size_t length);
} fake_frame_link_t;

/** The only link. */
extern fake_frame_link_t fake_frame_link;

/** Resets everything but the configuration. */
void fake_frame_link_reset(void);

/** Receives a datagram. */
void fake_frame_link_receive(const peer_t *peer, const uint8_t *bytes, size_t length);

/** Advances time: chunks arrive in memory, and datagrams are sent. */
void fake_frame_link_advance(void);

/** Messages in the mailbox. */
unsigned fake_frame_link_waiting(void);

/** Whether there is work to do when time advances. */
bool fake_frame_link_busy(void);

#endif
