/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The protocol over UDP, as docs/protocol.md, "UDP", has it. Gateware moves images and maps; this is the rest. */

#ifndef LITESTEREO_LINK_UDP_UDP_LINK_H
#define LITESTEREO_LINK_UDP_UDP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/frame_link.h"
#include "link/frame_pool.h"
#include "link/frame_stream.h"
#include "link/session.h"

/** A READ in line. */
typedef struct {
    peer_t    peer;   /**< Who gets the replies. */
    message_t first;  /**< The first of them, but that its length is that of all of them. */
    uint8_t   slot;   /**< Of the frame. */
} udp_read_t;

/** The link. */
typedef struct {
    frame_link_t         *driver;    /**< The gateware. */
    session_t            *session;   /**< Who answers messages. */
    counters_t           *counters;  /**< What is counted. */
    session_transfer_t    transfer;  /**< What the session is given. */
    frame_stream_t        stream;    /**< The way of streamed frames. */
    int                   streamed;  /**< Slot of the frame that it was opened for last; -1 before the first. */
    frame_link_counters_t counted;   /**< What of gateware's counters is in `counters` already. */
    udp_read_t            reads[PROTOCOL_READS_IN_LINE];  /**< The first `waiting`, oldest first. */
    unsigned              waiting;   /**< READs in line. */
    bool                  running;   /**< The oldest is being served. */
    _Alignas(FRAME_ALIGNMENT) uint8_t payload[PROTOCOL_CHUNK_SIZE];  /**< Of the reply, until gateware has read it. */
} udp_link_t;

/** Prepares the link, and has the session use it; STATUS_UNSUPPORTED if gateware has fewer slots than the pool. */
status_t udp_link_init(udp_link_t *link, frame_link_t *driver, session_t *session, counters_t *counters);

/** Makes the way of streamed frames, in udp_stream.c, if gateware has one. */
void udp_stream_init(udp_link_t *link);

/** Sends nothing of a streamed frame's map any more. */
void udp_stream_forget(udp_link_t *link, const frame_t *frame);

/** Answers what is in the mailbox, and has the next READ served; to be called often. */
void udp_link_poll(udp_link_t *link, uint64_t clock);

#endif
