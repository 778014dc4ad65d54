/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The protocol over UDP: docs/protocol.md, "UDP". Gateware moves images and maps; the rest is here. */

#ifndef LITESTEREO_LINK_UDP_UDP_LINK_H
#define LITESTEREO_LINK_UDP_UDP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/frame_link.h"
#include "link/frame_pool.h"
#include "link/frame_stream.h"
#include "link/session.h"

/** A queued READ. */
typedef struct {
    peer_t    peer;   /**< Receiver of the replies. */
    message_t first;  /**< The first reply, but with the length of all replies together. */
    uint8_t   slot;   /**< Slot of the frame. */
} udp_read_t;

/** The link. */
typedef struct {
    frame_link_t         *driver;    /**< The gateware. */
    session_t            *session;   /**< Answers messages. */
    counters_t           *counters;  /**< Counters of the device. */
    session_transfer_t    transfer;  /**< This link, as the session uses it. */
    frame_stream_t        stream;    /**< Path of streamed frames. */
    int                   streamed;  /**< Slot of the frame that the path was last opened for; -1 before the first. */
    frame_link_counters_t counted;   /**< Gateware's counters as last added to `counters`. */
    udp_read_t            reads[PROTOCOL_QUEUED_READS];  /**< The queue: the first `queued` entries, oldest first. */
    unsigned              queued;    /**< Number of queued READs. */
    bool                  sending;   /**< Gateware sends the oldest one. */
    uint8_t              *payload;   /**< Payload of the reply, until gateware has read it. */
} udp_link_t;

/** Prepares the link and gives it to the session; STATUS_UNSUPPORTED if gateware has fewer slots than the pool.
 *
 * `payload` is memory for PROTOCOL_CHUNK_SIZE bytes that gateware reads: in main RAM, a multiple of FRAME_ALIGNMENT.
 */
status_t udp_link_init(udp_link_t *link, frame_link_t *driver, session_t *session, counters_t *counters, uint8_t *payload);

/** Prepares the path of streamed frames, if gateware has one. In udp_stream.c. */
void udp_stream_init(udp_link_t *link);

/** Stops sending the map of a frame if it is streamed. In udp_stream.c. */
void udp_stream_forget(udp_link_t *link, const frame_t *frame);

/** Answers messages of the mailbox, and has gateware send the next READ; to be called often. */
void udp_link_poll(udp_link_t *link, uint64_t clock);

#endif
