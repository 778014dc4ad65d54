/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_frame_link.h"

#include <string.h>

#include "fake_stream.h"
#include "generated/csr.h"
#include "lib/bytes.h"
#include "link/protocol/message.h"
#include "litestereo/crc32.h"
#include "require.h"

#define SLOTS     4
#define ENTRIES   8
#define ALIGNMENT 16
#define CHUNK     PROTOCOL_CHUNK_SIZE
#define WORDS_MAX 256

/* Datagrams of a burst that are sent per step of time. */
#define DATAGRAMS_PER_STEP 32

fake_frame_link_t fake_frame_link = {.max_chunks = 1024, .port = PROTOCOL_UDP_PORT};

typedef struct {
    bool      busy;
    peer_t    peer;
    message_t first;
    uint32_t  base, length;
} job_t;

static struct {
    bool     enable;
    uint32_t token;
    peer_t   peer;
    uint32_t frame_id, base, pixels;  /* Staged for the slot to open. */
    struct {
        bool     open;
        uint32_t frame_id, base, pixels, missing;
        uint32_t arrived[WORDS_MAX];
    } slot[SLOTS];
    bool     clearing;
    unsigned cleared;  /* Slot, */
    bool     wanted;   /* and it has not been closed meanwhile. */
    struct {
        bool     busy;
        unsigned slot;
        uint32_t index, to, length;
        uint8_t  bytes[CHUNK];
    } chunk;  /* On its way to memory. */
    uint32_t arrived_index;
    uint32_t mailbox_base;
    uint8_t  produced, consumed;
    job_t    staged, reply, burst;
    bool     abort;
    uint32_t received, sent, malformed, overrun, foreign, unfit, chunks, repeated, while_matching;
    uint32_t counter;  /* The one that was read last. */
} regs;

static uint8_t *memory_at(uint32_t address)
{
    return (uint8_t *)(uintptr_t)address;
}

void fake_frame_link_reset(void)
{
    memset(&regs, 0, sizeof(regs));
    fake_stream_reset();
}

/* Chunks. */

static uint32_t pitch_of(uint32_t pixels)
{
    return (pixels + CHUNK - 1) / CHUNK * CHUNK;
}

/* Operations in progress end. */
static void settle(void)
{
    if (fake_frame_link.hang) {
        return;
    }
    if (regs.clearing) {
        memset(regs.slot[regs.cleared].arrived, 0, sizeof(regs.slot[0].arrived));
        regs.slot[regs.cleared].open = regs.wanted;
        regs.clearing                = false;
    }
    if (regs.chunk.busy) {
        memcpy(memory_at(regs.chunk.to), regs.chunk.bytes, regs.chunk.length);
        regs.slot[regs.chunk.slot].arrived[regs.chunk.index / 32] |= 1u << regs.chunk.index % 32;
        regs.slot[regs.chunk.slot].missing--;
        regs.chunk.busy = false;
    }
}

static int find_slot(uint32_t frame_id)
{
    for (int slot = 0; slot < SLOTS; slot++) {
        if (regs.slot[slot].open && regs.slot[slot].frame_id == frame_id) {
            return slot;
        }
    }
    return -1;
}

static bool is_foreign(const peer_t *peer, const message_t *message)
{
    return regs.token == 0 || message->session != regs.token || !peer_is(peer, &regs.peer);
}

static void take_pairs(const peer_t *peer, const message_t *message)
{
    if (is_foreign(peer, message)) {
        regs.foreign++;
        return;
    }
    switch (fake_stream_take(message)) {
    case FAKE_STREAM_TAKEN:    regs.chunks++; break;
    case FAKE_STREAM_REPEATED: regs.repeated++; break;
    default:                   regs.unfit++; break;
    }
}

static void take_chunk(const peer_t *peer, const message_t *message)
{
    uint32_t offset = message->offset;
    uint32_t pitch, within, rest;
    int      slot;

    if (is_foreign(peer, message)) {
        regs.foreign++;
        return;
    }
    slot = find_slot(message->frame_id);
    if (slot < 0 || regs.chunk.busy) {
        regs.unfit++;
        return;
    }
    pitch  = pitch_of(regs.slot[slot].pixels);
    within = offset < pitch ? offset : offset - pitch;
    rest   = within < regs.slot[slot].pixels ? regs.slot[slot].pixels - within : 0;
    if (offset % CHUNK != 0 || rest == 0 || message->length != (rest < CHUNK ? rest : CHUNK)) {
        regs.unfit++;
    } else if ((regs.slot[slot].arrived[offset / CHUNK / 32] >> offset / CHUNK % 32 & 1) != 0) {
        regs.repeated++;
    } else {
        regs.chunks++;
        regs.while_matching += fake_frame_link.matching != NULL && fake_frame_link.matching();
        regs.chunk.busy   = true;
        regs.chunk.slot   = (unsigned)slot;
        regs.chunk.index  = offset / CHUNK;
        regs.chunk.to     = regs.slot[slot].base + offset;
        regs.chunk.length = message->length;
        memcpy(regs.chunk.bytes, message->payload, message->length);
    }
}

/* Receiving. */

static void put_in_mailbox(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    uint8_t *entry = memory_at(regs.mailbox_base + regs.produced % ENTRIES * 2048u);

    if (fake_frame_link_waiting() >= ENTRIES) {
        regs.overrun++;
        return;
    }
    put_u32(entry, peer->address);
    put_u16(entry + 4, peer->port);
    put_u16(entry + 6, (uint16_t)length);
    memcpy(entry + 8, bytes, length);
    regs.produced++;
}

void fake_frame_link_receive(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    message_t message;

    settle();
    regs.received++;
    if (!regs.enable) {
        return;
    }
    if (message_parse(bytes, length, &message) != STATUS_OK) {
        regs.malformed++;
    } else if (message.type == TYPE_UPLOAD && message.version == PROTOCOL_VERSION) {
        take_chunk(peer, &message);
    } else if (fake_frame_link.streaming && message.type == TYPE_PAIRS && message.version == PROTOCOL_VERSION) {
        take_pairs(peer, &message);
    } else {
        put_in_mailbox(peer, bytes, length);
    }
}

/* Sending. */

static bool send_message(const peer_t *peer, const message_t *message)
{
    uint8_t bytes[PROTOCOL_MESSAGE_MAX];

    if (!fake_frame_link.send(peer, bytes, message_build(message, bytes))) {
        return false;
    }
    regs.sent++;
    return true;
}

/* Sends the first message of a job with `length` bytes of payload; returns whether it was sent. */
static bool send_one(const job_t *job, uint32_t length)
{
    message_t message = job->first;

    message.version = PROTOCOL_VERSION;
    message.length  = length;
    message.payload = memory_at(job->base);
    return send_message(&job->peer, &message);
}

static void advance_run(void)
{
    job_t *burst = &regs.burst;

    for (unsigned sent = 0; sent < DATAGRAMS_PER_STEP && burst->busy && !regs.abort; sent++) {
        uint32_t length = burst->length < CHUNK ? burst->length : CHUNK;

        if (!send_one(burst, length)) {
            return;
        }
        burst->length       -= length;
        burst->base         += CHUNK;
        burst->first.offset += CHUNK;
        burst->busy          = burst->length > 0;
    }
    burst->busy  = burst->busy && !regs.abort;
    regs.abort = false;
}

void fake_frame_link_advance(void)
{
    settle();
    if (fake_frame_link.hang) {
        return;
    }
    if (regs.reply.busy && send_one(&regs.reply, regs.reply.length)) {
        regs.reply.busy = false;
    }
    advance_run();
    fake_stream_advance(send_message);
}

unsigned fake_frame_link_waiting(void)
{
    return (uint8_t)(regs.produced - regs.consumed);
}

bool fake_frame_link_busy(void)
{
    return regs.clearing || regs.chunk.busy || regs.reply.busy || regs.burst.busy || fake_frame_link_waiting() > 0
        || fake_stream_sending();
}

/* Registers. */

uint16_t frame_link_version_read(void)               { return fake_frame_link.version; }
uint8_t  frame_link_streaming_read(void)             { return fake_frame_link.streaming; }
uint8_t  frame_link_stream_status_read(void)         { return fake_stream_status(); }
uint32_t frame_link_stream_offset_read(void)         { return fake_stream_offset(); }
uint8_t  frame_link_slots_read(void)                 { return SLOTS; }
uint16_t frame_link_max_chunks_read(void)            { return fake_frame_link.max_chunks; }
uint8_t  frame_link_mailbox_entries_read(void)       { return ENTRIES; }
uint16_t frame_link_alignment_read(void)             { return ALIGNMENT; }
uint16_t frame_link_port_read(void)                  { return fake_frame_link.port; }
uint8_t  frame_link_mailbox_produced_read(void)      { return regs.produced; }

void frame_link_stream_frame_id_write(uint32_t value) { fake_stream_staged.frame_id = value; }
void frame_link_stream_pixels_write(uint32_t value)   { fake_stream_staged.pixels = value; }
void frame_link_stream_sequence_write(uint32_t value) { fake_stream_staged.sequence = value; }
void frame_link_mac_high_write(uint16_t value)        { (void)value; }
void frame_link_mac_low_write(uint32_t value)         { (void)value; }
void frame_link_netmask_write(uint32_t value)         { (void)value; }
void frame_link_gateway_write(uint32_t value)         { (void)value; }
void frame_link_address_write(uint32_t value)         { (void)value; }
void frame_link_control_write(uint8_t value)          { regs.enable = (value & 1) != 0; }
void frame_link_token_write(uint32_t value)           { regs.token = value; }
void frame_link_slot_frame_id_write(uint32_t value)   { regs.frame_id = value; }
void frame_link_slot_base_write(uint32_t value)       { regs.base = value; }
void frame_link_slot_pixels_write(uint32_t value)     { regs.pixels = value; }
void frame_link_arrived_index_write(uint16_t value)   { regs.arrived_index = value; }
void frame_link_mailbox_base_write(uint32_t value)    { regs.mailbox_base = value; }
void frame_link_mailbox_consumed_write(uint8_t value) { regs.consumed = value; }
void frame_link_send_type_write(uint8_t value)        { regs.staged.first.type = value; }
void frame_link_send_session_write(uint32_t value)    { regs.staged.first.session = value; }
void frame_link_send_sequence_write(uint32_t value)   { regs.staged.first.sequence = value; }
void frame_link_send_frame_id_write(uint32_t value)   { regs.staged.first.frame_id = value; }
void frame_link_send_offset_write(uint32_t value)     { regs.staged.first.offset = value; }
void frame_link_send_base_write(uint32_t value)       { regs.staged.base = value; }
void frame_link_send_length_write(uint32_t value)     { regs.staged.length = value; }

void frame_link_peer_address_write(uint32_t value)
{
    regs.peer.udp     = true;
    regs.peer.address = value;
}

void frame_link_peer_port_write(uint16_t value)
{
    regs.peer.port = value;
}

void frame_link_send_address_write(uint32_t value)
{
    regs.staged.peer.udp     = true;
    regs.staged.peer.address = value;
}

void frame_link_send_port_write(uint16_t value)
{
    regs.staged.peer.port = value;
}

void frame_link_stream_control_write(uint8_t value)
{
    REQUIRE(value == 1 || value == 2);
    if (value == 2) {
        fake_stream_close();
    } else {
        fake_stream_open(regs.token, &regs.peer);
    }
}

void frame_link_slot_control_write(uint16_t value)
{
    unsigned slot = value & 0xff;

    REQUIRE(slot < SLOTS && (value >> 8 == 1 || value >> 8 == 2));
    if (value >> 8 == 2) {
        regs.slot[slot].open = false;
        regs.wanted          = regs.wanted && slot != regs.cleared;
        return;
    }
    REQUIRE(!regs.clearing && regs.base % ALIGNMENT == 0);
    REQUIRE(regs.pixels > 0 && 2 * pitch_of(regs.pixels) / CHUNK <= fake_frame_link.max_chunks);
    regs.slot[slot].open     = false;
    regs.slot[slot].frame_id = regs.frame_id;
    regs.slot[slot].base     = regs.base;
    regs.slot[slot].pixels   = regs.pixels;
    regs.slot[slot].missing  = 2 * pitch_of(regs.pixels) / CHUNK;
    regs.clearing            = true;
    regs.cleared             = slot;
    regs.wanted              = true;
}

uint8_t frame_link_slot_status_read(void)
{
    return (uint8_t)(regs.clearing | regs.chunk.busy << 1 | regs.chunk.slot << 4);
}

uint32_t frame_link_arrived_read(void)
{
    uint32_t words = fake_frame_link.max_chunks / 32u;

    REQUIRE(regs.arrived_index < SLOTS * words);
    return regs.slot[regs.arrived_index / words].arrived[regs.arrived_index % words];
}

void frame_link_counter_index_write(uint8_t value)
{
    switch (value) {
    case 0:  regs.counter = regs.received; break;
    case 1:  regs.counter = regs.malformed; break;
    case 8:  regs.counter = 0; break;  /* No datagram comes too fast. */
    case 9:  regs.counter = regs.overrun; break;
    case 10: regs.counter = regs.foreign; break;
    case 11: regs.counter = regs.unfit; break;
    case 12: regs.counter = regs.chunks; break;
    case 13: regs.counter = regs.repeated; break;
    case 14: regs.counter = regs.while_matching; break;
    case 15: regs.counter = regs.sent; break;
    default: REQUIRE(false);
    }
}

uint32_t frame_link_counter_read(void)
{
    return regs.counter;
}

void frame_link_send_control_write(uint8_t value)
{
    REQUIRE(regs.staged.base % ALIGNMENT == 0);
    if ((value & 1) != 0 && !regs.reply.busy) {
        REQUIRE(regs.staged.length <= CHUNK);
        regs.reply      = regs.staged;
        regs.reply.busy = true;
    }
    if ((value & 2) != 0 && !regs.burst.busy) {
        regs.burst      = regs.staged;
        regs.burst.busy = true;
        regs.abort    = false;
    }
    regs.abort |= (value & 4) != 0 && regs.burst.busy;
}

uint8_t frame_link_send_status_read(void)
{
    return (uint8_t)(regs.reply.busy | regs.burst.busy << 1);
}
