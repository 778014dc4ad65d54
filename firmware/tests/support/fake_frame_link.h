/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The gateware between UDP and memory in software, behind the functions of the stub csr.h. */

#ifndef FAKE_FRAME_LINK_H
#define FAKE_FRAME_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/peer.h"

/** What can be set before the firmware starts. */
typedef struct {
    uint16_t version;     /**< 0 if there is no such gateware, as it is unless set. */
    uint16_t max_chunks;  /**< A multiple of 32. */
    uint32_t address;     /**< IPv4. */
    uint16_t port;        /**< UDP. */
    bool     streaming;   /**< There is a way for streamed frames. */
    unsigned skips;       /**< One in so many parts of streamed maps, at random, never goes out; 0 for none. */
    bool     hang;        /**< Nothing that is under way comes to its end, and no pairs are taken. */
    bool   (*matching)(void);  /**< Whether the matcher is at work; may be null. */
    /** Takes a datagram; false if it cannot yet. */
    bool   (*send)(const peer_t *peer, const uint8_t *bytes, size_t length);
} fake_frame_link_t;

/** The one link. */
extern fake_frame_link_t fake_frame_link;

/** Forgets everything but what was set. */
void fake_frame_link_reset(void);

/** A datagram comes in. */
void fake_frame_link_receive(const peer_t *peer, const uint8_t *bytes, size_t length);

/** Lets time pass: chunks get to memory, and datagrams go out. */
void fake_frame_link_advance(void);

/** Messages in the mailbox. */
unsigned fake_frame_link_waiting(void);

/** Whether there is something to go on with when time passes. */
bool fake_frame_link_busy(void);

#endif
