/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "frame_link.h"

#include <stddef.h>

#include "dma_memory.h"
#include "lib/bytes.h"
#include "platform.h"

#define CONTROL_ENABLE REGISTER_BIT(FRAME_LINK_CONTROL_ENABLE)

#define SLOT_OPEN      REGISTER_BIT(FRAME_LINK_SLOT_CONTROL_OPEN)
#define SLOT_CLOSE     REGISTER_BIT(FRAME_LINK_SLOT_CONTROL_CLOSE)
#define SLOT_CLEARING  REGISTER_BIT(FRAME_LINK_SLOT_STATUS_CLEARING)
#define SLOT_WRITING   REGISTER_BIT(FRAME_LINK_SLOT_STATUS_WRITING)

#define SEND_REPLY     REGISTER_BIT(FRAME_LINK_SEND_CONTROL_REPLY)
#define SEND_BURST     REGISTER_BIT(FRAME_LINK_SEND_CONTROL_RUN)
#define SEND_ABORT     REGISTER_BIT(FRAME_LINK_SEND_CONTROL_ABORT)
#define REPLY_BUSY     REGISTER_BIT(FRAME_LINK_SEND_STATUS_REPLY_BUSY)
#define BURST_BUSY     REGISTER_BIT(FRAME_LINK_SEND_STATUS_RUN_BUSY)

#define STREAM_OPEN    REGISTER_BIT(FRAME_LINK_STREAM_CONTROL_OPEN)
#define STREAM_CLOSE   REGISTER_BIT(FRAME_LINK_STREAM_CONTROL_CLOSE)
#define STREAM_WAITING REGISTER_BIT(FRAME_LINK_STREAM_STATUS_OPEN)  /* Pairs are missing. */

#define ENTRY_PORT    4u  /* Offsets in an entry of the mailbox, bytes. */
#define ENTRY_LENGTH  6u
#define ENTRY_MESSAGE 8u

#define MOST_SLOTS    16u
#define MOST_CHUNKS   (8u * PROTOCOL_CHUNK_SIZE)  /* The reply to MISSING has a bit for each. */

/* Clocks allowed for operations that take the gateware microseconds. */
#define WAIT_BUDGET 100000u

/* Waits while `condition` holds; STATUS_TIMEOUT after WAIT_BUDGET. */
static status_t wait_while(bool (*condition)(void))
{
    uint64_t begin = clock_now();

    while (condition()) {
        if (clock_now() - begin > WAIT_BUDGET) {
            return STATUS_TIMEOUT;
        }
    }
    return STATUS_OK;
}

static bool is_clearing(void)
{
    return (frame_link_slot_status_read() & SLOT_CLEARING) != 0;
}

static bool is_writing(void)
{
    return (frame_link_slot_status_read() & SLOT_WRITING) != 0;
}

static bool is_sending_reply(void)
{
    return (frame_link_send_status_read() & REPLY_BUSY) != 0;
}

static bool is_sending_burst(void)
{
    return (frame_link_send_status_read() & BURST_BUSY) != 0;
}

static bool is_power_of_two(uint32_t value)
{
    return value != 0 && (value & (value - 1)) == 0;
}

static bool capabilities_are_valid(const frame_link_capabilities_t *can)
{
    return can->version == FRAME_LINK_VERSION && can->slots > 0 && can->slots <= MOST_SLOTS
        && can->max_chunks > 0 && can->max_chunks % 32 == 0 && can->max_chunks <= MOST_CHUNKS
        && is_power_of_two(can->mailbox_entries) && can->mailbox_entries <= FRAME_LINK_MAX_ENTRIES
        && is_power_of_two(can->alignment) && can->alignment <= FRAME_LINK_MAX_ALIGNMENT;
}

/* Whether gateware may be given this memory; a message without a payload has an address all the same. */
static bool is_reachable(const frame_link_t *link, const uint8_t *address, uint32_t bytes)
{
    return dma_reaches(address, bytes > 0 ? bytes : 1, link->capabilities.alignment);
}

/* After a restart of the firmware alone the gateware may still be running; it must not touch memory that is ours
 * now. */
static status_t stop_everything(frame_link_t *link)
{
    status_t reply, burst, stream;

    frame_link_control_write(0);
    frame_link_token_write(0);
    for (unsigned slot = 0; slot < link->capabilities.slots; slot++) {
        frame_link_slot_control_write((uint16_t)(slot | SLOT_CLOSE));
    }
    frame_link_send_control_write(SEND_ABORT);
    burst  = wait_while(is_sending_burst);
    reply  = wait_while(is_sending_reply);
    stream = frame_link_close_stream(link);
    if (burst != STATUS_OK || reply != STATUS_OK || stream != STATUS_OK) {
        return STATUS_TIMEOUT;
    }
    return wait_while(is_writing);
}

/* The last one starts the network. */
static void set_addresses(void)
{
    frame_link_mac_high_write(NETWORK_MAC_HIGH);
    frame_link_mac_low_write(NETWORK_MAC_LOW);
    frame_link_netmask_write(NETWORK_NETMASK);
    frame_link_gateway_write(NETWORK_GATEWAY);
    frame_link_address_write(NETWORK_ADDRESS);
}

status_t frame_link_init(frame_link_t *link, uint8_t *mailbox)
{
    status_t status;

    if (link == NULL || mailbox == NULL || (uintptr_t)mailbox % FRAME_LINK_MAX_ALIGNMENT != 0) {
        return STATUS_BAD_ARGUMENT;
    }
    *link = (frame_link_t){
        .capabilities = {
            .version         = (uint16_t)frame_link_version_read(),
            .slots           = (uint8_t)frame_link_slots_read(),
            .max_chunks      = (uint16_t)frame_link_max_chunks_read(),
            .mailbox_entries = (uint8_t)frame_link_mailbox_entries_read(),
            .alignment       = (uint16_t)frame_link_alignment_read(),
            .address         = NETWORK_ADDRESS,
            .port            = (uint16_t)frame_link_port_read(),
            .streaming       = frame_link_streaming_read() != 0,
        },
        .mailbox = mailbox,
    };
    if (!capabilities_are_valid(&link->capabilities)) {
        return STATUS_UNSUPPORTED;
    }
    if (!is_reachable(link, mailbox, link->capabilities.mailbox_entries * FRAME_LINK_ENTRY_SIZE)) {
        return STATUS_BAD_ARGUMENT;
    }
    status = stop_everything(link);
    if (status != STATUS_OK) {
        return status;
    }
    set_addresses();
    frame_link_mailbox_base_write((uint32_t)(uintptr_t)mailbox);
    link->produced = (uint8_t)frame_link_mailbox_produced_read();
    link->consumed = link->produced;
    frame_link_mailbox_consumed_write(link->consumed);
    /* What the CPU wrote there must reach the mailbox before any message does. */
    memory_to_device();
    frame_link_control_write(CONTROL_ENABLE);
    return STATUS_OK;
}

status_t frame_link_set_session(frame_link_t *link, uint32_t token, const peer_t *peer)
{
    if (link == NULL || peer == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    /* No token while the peer changes, so that no chunk is compared with half of the old and half of the new. */
    frame_link_token_write(0);
    frame_link_peer_address_write(peer->address);
    frame_link_peer_port_write(peer->port);
    if (token != 0) {
        frame_link_token_write(token);
    }
    return STATUS_OK;
}

status_t frame_link_open_slot(frame_link_t *link, unsigned slot, uint32_t frame_id, uint8_t *memory, uint32_t pixels)
{
    uint32_t chunks;

    if (link == NULL || slot >= link->capabilities.slots || !is_reachable(link, memory, 1) || pixels == 0) {
        return STATUS_BAD_ARGUMENT;
    }
    chunks = (pixels - 1) / PROTOCOL_CHUNK_SIZE + 1;  /* Of an image. */
    if (chunks > link->capabilities.max_chunks / 2u) {
        return STATUS_SIZE;
    }
    if (!is_reachable(link, memory, 2 * chunks * PROTOCOL_CHUNK_SIZE)) {
        return STATUS_BAD_ARGUMENT;
    }
    if (wait_while(is_clearing) != STATUS_OK) {
        return STATUS_TIMEOUT;
    }
    frame_link_slot_frame_id_write(frame_id);
    frame_link_slot_base_write((uint32_t)(uintptr_t)memory);
    frame_link_slot_pixels_write(pixels);
    /* What the CPU wrote there must reach the slot before any chunk does. */
    memory_to_device();
    frame_link_slot_control_write((uint16_t)(slot | SLOT_OPEN));
    if (wait_while(is_clearing) != STATUS_OK) {
        frame_link_slot_control_write((uint16_t)(slot | SLOT_CLOSE));
        return STATUS_TIMEOUT;
    }
    return STATUS_OK;
}

status_t frame_link_close_slot(frame_link_t *link, unsigned slot)
{
    uint64_t begin;
    uint32_t status;

    if (link == NULL || slot >= link->capabilities.slots) {
        return STATUS_BAD_ARGUMENT;
    }
    frame_link_slot_control_write((uint16_t)(slot | SLOT_CLOSE));
    begin  = clock_now();
    status = frame_link_slot_status_read();
    /* Wait for chunks of this slot only: those of other slots may keep the gateware writing for any time. */
    while ((status & SLOT_WRITING) != 0 && REGISTER_FIELD(FRAME_LINK_SLOT_STATUS_SLOT, status) == slot) {
        if (clock_now() - begin > WAIT_BUDGET) {
            return STATUS_TIMEOUT;
        }
        status = frame_link_slot_status_read();
    }
    memory_from_device();
    return STATUS_OK;
}

uint32_t frame_link_arrived(const frame_link_t *link, unsigned slot, unsigned word)
{
    unsigned words = link->capabilities.max_chunks / 32u;

    if (slot >= link->capabilities.slots || word >= words) {
        return 0;
    }
    frame_link_arrived_index_write((uint16_t)(slot * words + word));
    return frame_link_arrived_read();
}

status_t frame_link_peek(frame_link_t *link, frame_link_message_t *message)
{
    const uint8_t *entry;
    size_t         length;

    if (link->consumed == link->produced) {
        link->produced = (uint8_t)frame_link_mailbox_produced_read();
        if (link->consumed == link->produced) {
            return STATUS_IDLE;
        }
        /* Once for all messages that have arrived. */
        memory_from_device();
    }
    entry = link->mailbox + link->consumed % link->capabilities.mailbox_entries * FRAME_LINK_ENTRY_SIZE;
    length = get_u16(entry + ENTRY_LENGTH);
    *message = (frame_link_message_t){
        .peer   = {.udp = true, .address = get_u32(entry), .port = get_u16(entry + ENTRY_PORT)},
        .bytes  = entry + ENTRY_MESSAGE,
        .length = length < FRAME_LINK_ENTRY_SIZE - ENTRY_MESSAGE ? length : FRAME_LINK_ENTRY_SIZE - ENTRY_MESSAGE,
    };
    return STATUS_OK;
}

void frame_link_drop(frame_link_t *link)
{
    if (link->consumed != link->produced) {
        link->consumed++;
        frame_link_mailbox_consumed_write(link->consumed);
    }
}

/* Writes the registers of a message and begins to send it, with SEND_REPLY or SEND_BURST. */
static void send(const peer_t *peer, const message_t *message, uint8_t control)
{
    frame_link_send_address_write(peer->address);
    frame_link_send_port_write(peer->port);
    frame_link_send_type_write(message->type);
    frame_link_send_session_write(message->session);
    frame_link_send_sequence_write(message->sequence);
    frame_link_send_frame_id_write(message->frame_id);
    frame_link_send_offset_write(message->offset);
    frame_link_send_base_write((uint32_t)(uintptr_t)message->payload);
    frame_link_send_length_write(message->length);
    memory_to_device();
    frame_link_send_control_write(control);
}

status_t frame_link_reply(frame_link_t *link, const peer_t *peer, const message_t *message)
{
    if (link == NULL || peer == NULL || message == NULL || !is_reachable(link, message->payload, message->length)
        || message->length > PROTOCOL_CHUNK_SIZE) {
        return STATUS_BAD_ARGUMENT;
    }
    if (is_sending_reply()) {
        return STATUS_BUSY;
    }
    send(peer, message, SEND_REPLY);
    return STATUS_OK;
}

bool frame_link_reply_busy(const frame_link_t *link)
{
    (void)link;
    return is_sending_reply();
}

status_t frame_link_send_burst(frame_link_t *link, const peer_t *peer, const message_t *message)
{
    if (link == NULL || peer == NULL || message == NULL || !is_reachable(link, message->payload, message->length)
        || message->length == 0) {
        return STATUS_BAD_ARGUMENT;
    }
    if (is_sending_burst()) {
        return STATUS_BUSY;
    }
    send(peer, message, SEND_BURST);
    return STATUS_OK;
}

bool frame_link_burst_busy(const frame_link_t *link)
{
    (void)link;
    return is_sending_burst();
}

status_t frame_link_abort_burst(frame_link_t *link)
{
    if (link == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    frame_link_send_control_write(SEND_ABORT);
    return wait_while(is_sending_burst);
}

/* Streamed frames: pairs from datagrams to the matcher, parts of the map from the matcher to datagrams. */

static bool is_streaming(void)
{
    return frame_link_stream_status_read() != 0;
}

status_t frame_link_open_stream(frame_link_t *link, uint32_t frame_id, uint32_t pixels, uint32_t sequence)
{
    if (link == NULL || pixels == 0) {
        return STATUS_BAD_ARGUMENT;
    }
    if (!link->capabilities.streaming) {
        return STATUS_UNSUPPORTED;
    }
    if (is_streaming()) {
        return STATUS_BUSY;
    }
    frame_link_stream_frame_id_write(frame_id);
    frame_link_stream_pixels_write(pixels);
    frame_link_stream_sequence_write(sequence);
    frame_link_stream_control_write(STREAM_OPEN);
    return STATUS_OK;
}

bool frame_link_stream_busy(const frame_link_t *link)
{
    (void)link;
    return is_streaming();
}

uint32_t frame_link_stream_wanted(const frame_link_t *link)
{
    uint32_t offset = frame_link_stream_offset_read();

    (void)link;
    /* The offset is read first: if the last pairs arrive before the status is read, it is not used. */
    return (frame_link_stream_status_read() & STREAM_WAITING) != 0 ? offset : PROTOCOL_NO_OFFSET;
}

status_t frame_link_close_stream(frame_link_t *link)
{
    if (link == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    frame_link_stream_control_write(STREAM_CLOSE);
    return wait_while(is_streaming);
}

/* Counters. */

enum {  /* Values of counter_index. */
    DATAGRAMS_RECEIVED  = 0,
    DATAGRAMS_MALFORMED = 1,
    DATAGRAMS_OVERRUN   = 8,
    MAILBOX_OVERRUN,
    UPLOADS_FOREIGN,
    UPLOADS_UNFIT,
    CHUNKS_RECEIVED,
    CHUNKS_REPEATED,
    CHUNKS_WHILE_MATCHING,
    DATAGRAMS_SENT,
};

static uint32_t read_counter(uint8_t index)
{
    frame_link_counter_index_write(index);
    return frame_link_counter_read();
}

void frame_link_count(const frame_link_t *link, frame_link_counters_t *counters)
{
    (void)link;
    *counters = (frame_link_counters_t){
        .datagrams_received    = read_counter(DATAGRAMS_RECEIVED),
        .datagrams_sent        = read_counter(DATAGRAMS_SENT),
        .datagrams_malformed   = read_counter(DATAGRAMS_MALFORMED),
        .datagrams_overrun     = read_counter(DATAGRAMS_OVERRUN),
        .mailbox_overrun       = read_counter(MAILBOX_OVERRUN),
        .uploads_foreign       = read_counter(UPLOADS_FOREIGN),
        .uploads_unfit         = read_counter(UPLOADS_UNFIT),
        .chunks_received       = read_counter(CHUNKS_RECEIVED),
        .chunks_repeated       = read_counter(CHUNKS_REPEATED),
        .chunks_while_matching = read_counter(CHUNKS_WHILE_MATCHING),
    };
}
