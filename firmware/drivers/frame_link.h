/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the frame link: gateware that moves images from datagrams to memory and maps from memory to datagrams, and
 * leaves all other messages to software. Every wait is bounded. A SoC may be built without a frame link. */

#ifndef LITESTEREO_DRIVERS_FRAME_LINK_H
#define LITESTEREO_DRIVERS_FRAME_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/message.h"
#include "link/protocol/peer.h"
#include "litestereo/status.h"

/** Version of the registers that this driver supports, major x 256 + minor. */
#define FRAME_LINK_VERSION 0x0004u

/** Largest alignment of bases that this firmware lays memory out for, in bytes. */
#define FRAME_LINK_MAX_ALIGNMENT 64u

/** Bytes from one message in the mailbox to the next. */
#define FRAME_LINK_ENTRY_SIZE 2048u

/** Most messages in a mailbox that this firmware has memory for. */
#define FRAME_LINK_MAX_ENTRIES 8u

/** Bytes of such a mailbox. */
#define FRAME_LINK_MAILBOX_SIZE (FRAME_LINK_MAX_ENTRIES * FRAME_LINK_ENTRY_SIZE)

/** What the gateware was built for. */
typedef struct {
    uint16_t version;          /**< Major x 256 + minor, FRAME_LINK_VERSION. */
    uint8_t  slots;            /**< Frames that can receive chunks at the same time, 1 to 16. */
    uint16_t max_chunks;       /**< Most chunks of a frame, both images; a multiple of 32. */
    uint8_t  mailbox_entries;  /**< Messages that the mailbox holds, a power of two, FRAME_LINK_MAX_ENTRIES at most. */
    uint16_t alignment;        /**< Bytes, a power of two: of base addresses. */
    uint32_t address;          /**< The device's IPv4 address, of the SoC's constants; 192.168.1.50 is 0xc0a80132. */
    uint16_t port;             /**< The device's UDP port. */
    bool     streaming;        /**< Pixels can go from datagrams directly to the matcher, and maps back. */
} frame_link_capabilities_t;

/** A message in the mailbox. */
typedef struct {
    peer_t         peer;    /**< Its sender. */
    const uint8_t *bytes;   /**< The message. */
    size_t         length;  /**< Its length in bytes, at most what an entry holds. */
} frame_link_message_t;

/** Counters of the gateware since reset, each modulo 2**32; described in docs/protocol.md. */
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
    const uint8_t            *mailbox;       /**< Memory that gateware writes messages to. */
    uint8_t                   produced;      /**< Messages written so far, when last read, modulo 256. */
    uint8_t                   consumed;      /**< Messages dropped so far, modulo 256. */
} frame_link_t;

/** Reads the capabilities, stops the gateware, tells it the device's addresses, and lets it receive messages.
 *
 * `mailbox` is memory of FRAME_LINK_MAILBOX_SIZE bytes, aligned to FRAME_LINK_MAX_ALIGNMENT, for the gateware alone.
 * STATUS_BAD_ARGUMENT if it is not aligned, STATUS_UNSUPPORTED if the SoC has no frame link that this driver supports,
 * STATUS_TIMEOUT if the gateware does not stop.
 */
status_t frame_link_init(frame_link_t *link, uint8_t *mailbox);

/** Accepts chunks from this peer with this token only; none at all if the token is 0. */
status_t frame_link_set_session(frame_link_t *link, uint32_t token, const peer_t *peer);

/** Accepts the chunks of a frame whose left image is at `memory`, from the return on.
 *
 * STATUS_BAD_ARGUMENT no such slot, memory that is not aligned, or 0 pixels
 * STATUS_SIZE         more chunks than the gateware counts
 * STATUS_TIMEOUT      the gateware does not become ready
 */
status_t frame_link_open_slot(frame_link_t *link, unsigned slot, uint32_t frame_id, uint8_t *memory, uint32_t pixels);

/** Accepts no more chunks for a slot. Once this returns STATUS_OK nothing more is written to its memory. */
status_t frame_link_close_slot(frame_link_t *link, unsigned slot);

/** Chunks of a slot that have arrived in memory: bit i is chunk 32 x `word` + i. 0 if there is no such slot or word. */
uint32_t frame_link_arrived(const frame_link_t *link, unsigned slot, unsigned word);

/** Gets the oldest message in the mailbox, STATUS_IDLE if there is none; it stays there until frame_link_drop. */
status_t frame_link_peek(frame_link_t *link, frame_link_message_t *message);

/** Drops the message that frame_link_peek got, so that the gateware can use its place again. */
void frame_link_drop(frame_link_t *link);

/** Sends a message with at most PROTOCOL_CHUNK_SIZE bytes of aligned payload; the gateware fills in the version.
 *
 * STATUS_BUSY while the payload of the previous reply is in use; the caller must not change that payload until then.
 */
status_t frame_link_reply(frame_link_t *link, const peer_t *peer, const message_t *message);

/** Whether the payload of the last reply is still in use. */
bool frame_link_reply_busy(const frame_link_t *link);

/** Begins to send a burst: any number of bytes, as messages of PROTOCOL_CHUNK_SIZE and a rest, with ascending offsets.
 *
 * STATUS_BUSY while another burst is being sent. Replies are sent in between.
 */
status_t frame_link_send_burst(frame_link_t *link, const peer_t *peer, const message_t *message);

/** Whether the payload of a burst is still in use. */
bool frame_link_burst_busy(const frame_link_t *link);

/** Aborts a burst and waits until its payload is no longer in use. */
status_t frame_link_abort_burst(frame_link_t *link);

/** Passes the pixel pairs of a frame, in order, to the matcher, and sends the map as the matcher writes it.
 *
 * The parts of the map go to the session's peer with its token, and carry `sequence`. Call it before the matcher
 * starts. STATUS_BAD_ARGUMENT 0 pixels
 * STATUS_UNSUPPORTED  the gateware was built without streaming
 * STATUS_BUSY         the previous frame still lacks pairs, or parts of its map have not been sent
 */
status_t frame_link_open_stream(frame_link_t *link, uint32_t frame_id, uint32_t pixels, uint32_t sequence);

/** Whether pairs are missing, or parts of the map have not been sent. */
bool frame_link_stream_busy(const frame_link_t *link);

/** Offset in bytes of the next pairs, or PROTOCOL_NO_OFFSET if all have arrived. */
uint32_t frame_link_stream_wanted(const frame_link_t *link);

/** Accepts no more pairs, and sends no more of the map once this returns STATUS_OK. Stop the matcher before. */
status_t frame_link_close_stream(frame_link_t *link);

/** Reads all counters. */
void frame_link_count(const frame_link_t *link, frame_link_counters_t *counters);

#endif
