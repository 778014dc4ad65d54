/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the frame link: gateware that takes images from datagrams to memory and maps from memory to datagrams,
 * and leaves all other messages to software. Every wait in it is bounded. A SoC may be built without it. */

#ifndef LITESTEREO_DRIVERS_FRAME_LINK_H
#define LITESTEREO_DRIVERS_FRAME_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/message.h"
#include "link/protocol/peer.h"
#include "litestereo/status.h"

/** Version of the registers that this driver knows, major x 256 + minor. */
#define FRAME_LINK_VERSION 0x0002u

/** Largest alignment of bases that this firmware lays memory out for, in bytes. */
#define FRAME_LINK_MAX_ALIGNMENT 64u

/** Bytes from one message in the mailbox to the next. */
#define FRAME_LINK_ENTRY_SIZE 2048u

/** Most messages of a mailbox that this firmware has room for. */
#define FRAME_LINK_MAX_ENTRIES 8u

/** Bytes of such a mailbox. */
#define FRAME_LINK_MAILBOX_SIZE (FRAME_LINK_MAX_ENTRIES * FRAME_LINK_ENTRY_SIZE)

/** What the gateware was built for. */
typedef struct {
    uint16_t version;          /**< Major x 256 + minor, FRAME_LINK_VERSION. */
    uint8_t  slots;            /**< Frames that it takes chunks for at a time, 1 to 16. */
    uint16_t max_chunks;       /**< Most chunks of a frame, both images; a multiple of 32. */
    uint8_t  mailbox_entries;  /**< Messages that the mailbox holds, a power of two, FRAME_LINK_MAX_ENTRIES at most. */
    uint16_t alignment;        /**< Bytes, a power of two: of base addresses. */
    uint32_t address;          /**< The device's IPv4 address, 192.168.1.50 is 0xc0a80132. */
    uint16_t port;             /**< The device's UDP port. */
    bool     streaming;        /**< There is a way from datagrams to the matcher, and back, past memory. */
} frame_link_capabilities_t;

/** A message in the mailbox. */
typedef struct {
    peer_t         peer;    /**< Whom it came from. */
    const uint8_t *bytes;   /**< The message. */
    size_t         length;  /**< Bytes of it, never more than an entry holds. */
} frame_link_message_t;

/** What the gateware counted since reset, each modulo 2**32; docs/protocol.md says what. */
typedef struct {
    uint32_t datagrams_received;
    uint32_t datagrams_sent;
    uint32_t datagrams_malformed;
    uint32_t datagrams_overrun;
    uint32_t mailbox_overrun;
    uint32_t uploads_foreign;
    uint32_t uploads_unfit;
    uint32_t chunks_received;
    uint32_t chunks_repeated;
    uint32_t chunks_while_matching;
} frame_link_counters_t;

/** Handle of the frame link. */
typedef struct {
    frame_link_capabilities_t capabilities;  /**< Read once by frame_link_init. */
    const uint8_t            *mailbox;       /**< Where gateware puts messages. */
    uint8_t                   produced;      /**< Messages ever put there, when last looked at, modulo 256. */
    uint8_t                   consumed;      /**< Messages ever taken out, modulo 256. */
} frame_link_t;

/** Reads what the gateware can do, stops whatever goes on, and lets messages in.
 *
 * `mailbox` is memory of FRAME_LINK_MAILBOX_SIZE, aligned to FRAME_LINK_MAX_ALIGNMENT, that nobody else uses.
 * STATUS_BAD_ARGUMENT if it is not aligned, STATUS_UNSUPPORTED if there is no such gateware or none that this driver
 * knows, STATUS_TIMEOUT if it does not come to rest.
 */
status_t frame_link_init(frame_link_t *link, uint8_t *mailbox);

/** From now on takes chunks with that token from that peer; of nobody if the token is 0. */
status_t frame_link_set_session(frame_link_t *link, uint32_t token, const peer_t *peer);

/** Begins to take the chunks of a frame whose left image is at `memory`; they are taken once this returns.
 *
 * STATUS_BAD_ARGUMENT no such slot, memory that is not aligned, or no pixel
 * STATUS_SIZE         more chunks than the gateware counts
 * STATUS_TIMEOUT      the gateware does not get ready
 */
status_t frame_link_open_slot(frame_link_t *link, unsigned slot, uint32_t frame_id, uint8_t *memory, uint32_t pixels);

/** Takes no more chunks for a slot; no more is written to its memory once this returns STATUS_OK. */
status_t frame_link_close_slot(frame_link_t *link, unsigned slot);

/** Chunks of a slot that are in memory: bit i is chunk 32 x `word` + i. 0 if there is no such slot or word. */
uint32_t frame_link_arrived(const frame_link_t *link, unsigned slot, unsigned word);

/** Oldest message of the mailbox, STATUS_IDLE if there is none; it stays the oldest until frame_link_drop. */
status_t frame_link_look(frame_link_t *link, frame_link_message_t *message);

/** Gives the place of the message that frame_link_look told of back to the gateware. */
void frame_link_drop(frame_link_t *link);

/** Sends a message of at most PROTOCOL_CHUNK_SIZE bytes of aligned payload; its version is the gateware's.
 *
 * STATUS_BUSY while the payload of the one before is in use, so also until the caller may write to it again.
 */
status_t frame_link_reply(frame_link_t *link, const peer_t *peer, const message_t *message);

/** Whether the payload of a reply is still in use. */
bool frame_link_reply_busy(const frame_link_t *link);

/** Begins to send any number of bytes, one message per PROTOCOL_CHUNK_SIZE begun, their offsets one after the other.
 *
 * STATUS_BUSY while another such run goes on. Replies pass it.
 */
status_t frame_link_run(frame_link_t *link, const peer_t *peer, const message_t *message);

/** Whether the payload of a run is still in use. */
bool frame_link_run_busy(const frame_link_t *link);

/** Gives a run up and waits until its payload is not in use any more. */
status_t frame_link_abort_run(frame_link_t *link);

/** Takes the pixel pairs of a frame, in order, for the matcher, and sends its map as it comes out of it.
 *
 * The parts of the map go to the peer and with the token of the session, and carry `sequence`. To be opened before the
 * matcher starts.
 * STATUS_BAD_ARGUMENT no pixel
 * STATUS_UNSUPPORTED  there is no way past memory
 * STATUS_BUSY         the one before lacks pairs, or parts of its map have not left yet
 */
status_t frame_link_open_stream(frame_link_t *link, uint32_t frame_id, uint32_t pixels, uint32_t sequence);

/** Whether pairs are missing, or parts of the map have not left. */
bool frame_link_stream_busy(const frame_link_t *link);

/** Offset in bytes of the pairs that come next, or PROTOCOL_NO_OFFSET if all are in. */
uint32_t frame_link_stream_wanted(const frame_link_t *link);

/** Takes no more pairs, and sends no more of the map once this returns STATUS_OK; after the matcher was stopped. */
status_t frame_link_close_stream(frame_link_t *link);

/** Reads all counters. */
void frame_link_count(const frame_link_t *link, frame_link_counters_t *counters);

#endif
