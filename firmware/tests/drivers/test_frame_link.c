/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the frame link, register by register. */

#include <string.h>

#include "drivers/frame_link.h"
#include "lib/bytes.h"
#include "mock_csr.h"
#include "require.h"

#define CLEARING  1u
#define WRITING   2u
#define REPLYING  1u
#define RUNNING   2u
#define STREAM_OPEN    1u
#define STREAM_SENDING 2u
#define SLOTS     3u
#define STEP      10u  /* Clocks from one call of clock_now() to the next. */
#define PATIENCE  100000u

static _Alignas(FRAME_LINK_MAX_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];

static frame_link_t link;
static const peer_t peer = {.udp = true, .address = 0xc0a80164, .port = 0xabcd};

static uint8_t *address(uintptr_t value)
{
    return (uint8_t *)value;
}

typedef struct {
    uint32_t version, slots, max_chunks, entries, alignment;
} built_t;

static const built_t usual = {FRAME_LINK_VERSION, SLOTS, 96, 8, 16};

static uint32_t streaming = 1;

static void expect_capabilities(const built_t *built)
{
    expect_read("version", built->version);
    expect_read("slots", built->slots);
    expect_read("max_chunks", built->max_chunks);
    expect_read("mailbox_entries", built->entries);
    expect_read("alignment", built->alignment);
    expect_read("port", 0xabcd);
    expect_read("streaming", streaming);
}

static void expect_stop(const built_t *built)
{
    expect_write("control", 0);
    expect_write("token", 0);
    for (uint32_t slot = 0; slot < built->slots; slot++) {
        expect_write("slot_control", slot | 1u << 9);
    }
    expect_write("send_control", 4);
}

static void expect_closing(void)
{
    expect_write("stream_control", 2);
}

static void expect_start(uint8_t produced)
{
    expect_write("mac_high", 0x10e2);
    expect_write("mac_low", 0xd5000002);
    expect_write("netmask", 0xffffff00);
    expect_write("gateway", 0xc0a80101);
    expect_write("address", 0xc0a80132);
    expect_write("mailbox_base", (uint32_t)(uintptr_t)mailbox);
    expect_read("mailbox_produced", produced);
    expect_write("mailbox_consumed", produced);
    expect_call("memory_to_device");
    expect_write("control", 1);
}

static void set_up_built(const built_t *built, uint8_t produced)
{
    mock_clock      = 0;
    mock_clock_step = STEP;
    expect_capabilities(built);
    expect_stop(built);
    expect_read("send_status", 0);
    expect_read("send_status", 0);
    expect_closing();
    expect_read("stream_status", 0);
    expect_read("slot_status", 0);
    expect_start(produced);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_OK);
    require_all_done();
}

static void set_up(void)
{
    set_up_built(&usual, 0);
}

/* Bad arguments touch no register. */
static void test_bad_arguments(void)
{
    static const message_t message = {.payload = mailbox, .length = 1};
    message_t              bad     = message;
    frame_link_message_t   received;

    REQUIRE(frame_link_init(NULL, mailbox) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_init(&link, NULL) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_init(&link, mailbox + FRAME_LINK_MAX_ALIGNMENT / 2) == STATUS_BAD_ARGUMENT);
    set_up();
    REQUIRE(frame_link_set_session(NULL, 1, &peer) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_set_session(&link, 1, NULL) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(NULL, 0, 1, address(64), 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(&link, SLOTS, 1, address(64), 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(&link, 0, 1, NULL, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(&link, 0, 1, address(72), 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(&link, 0, 1, address(64), 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_open_slot(&link, 0, 1, address(64), 48 * 1024 + 1) == STATUS_SIZE);
    REQUIRE(frame_link_open_slot(&link, 0, 1, address(64), 0xffffffff) == STATUS_SIZE);
    REQUIRE(frame_link_close_slot(NULL, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_close_slot(&link, SLOTS) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_arrived(&link, SLOTS, 0) == 0 && frame_link_arrived(&link, 0, 3) == 0);
    REQUIRE(frame_link_reply(NULL, &peer, &message) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_reply(&link, NULL, &message) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_reply(&link, &peer, NULL) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_send_burst(NULL, &peer, &message) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_send_burst(&link, NULL, &message) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_send_burst(&link, &peer, NULL) == STATUS_BAD_ARGUMENT);
    bad.payload = mailbox + 8;
    REQUIRE(frame_link_reply(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_send_burst(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    bad.payload = NULL;
    REQUIRE(frame_link_reply(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_send_burst(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    bad = message;
    bad.length = PROTOCOL_CHUNK_SIZE + 1;
    REQUIRE(frame_link_reply(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    bad.length = 0;
    REQUIRE(frame_link_send_burst(&link, &peer, &bad) == STATUS_BAD_ARGUMENT);
    REQUIRE(frame_link_abort_burst(NULL) == STATUS_BAD_ARGUMENT);
    /* No message was peeked at, so there is none to drop. */
    frame_link_drop(&link);
    expect_read("mailbox_produced", 0);
    REQUIRE(frame_link_peek(&link, &received) == STATUS_IDLE);
    require_all_done();
}

static void test_init(void)
{
    static const built_t wrong[] = {
        {0, SLOTS, 96, 8, 16}, {0x0001, SLOTS, 96, 8, 16}, {0x0102, SLOTS, 96, 8, 16},
        {FRAME_LINK_VERSION, 0, 96, 8, 16}, {FRAME_LINK_VERSION, 17, 96, 8, 16},
        {FRAME_LINK_VERSION, SLOTS, 0, 8, 16}, {FRAME_LINK_VERSION, SLOTS, 95, 8, 16},
        {FRAME_LINK_VERSION, SLOTS, 8224, 8, 16},
        {FRAME_LINK_VERSION, SLOTS, 96, 0, 16}, {FRAME_LINK_VERSION, SLOTS, 96, 6, 16},
        {FRAME_LINK_VERSION, SLOTS, 96, 16, 16},
        {FRAME_LINK_VERSION, SLOTS, 96, 8, 0}, {FRAME_LINK_VERSION, SLOTS, 96, 8, 12},
        {FRAME_LINK_VERSION, SLOTS, 96, 8, 128},
    };
    static const built_t right[] = {
        {FRAME_LINK_VERSION, 1, 32, 1, 1}, {FRAME_LINK_VERSION, 16, 8192, 8, 64}, {FRAME_LINK_VERSION, 4, 1024, 4, 4},
    };

    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        expect_capabilities(&wrong[i]);
        REQUIRE(frame_link_init(&link, mailbox) == STATUS_UNSUPPORTED);
        require_all_done();
    }
    for (size_t i = 0; i < sizeof(right) / sizeof(right[0]); i++) {
        streaming = i == 1 ? 0 : 1;
        set_up_built(&right[i], (uint8_t)(i * 100));
        REQUIRE(link.capabilities.version == right[i].version && link.capabilities.slots == right[i].slots);
        REQUIRE(link.capabilities.max_chunks == right[i].max_chunks);
        REQUIRE(link.capabilities.mailbox_entries == right[i].entries);
        REQUIRE(link.capabilities.alignment == right[i].alignment);
        REQUIRE(link.capabilities.streaming == (streaming != 0));
        REQUIRE(link.capabilities.address == 0xc0a80132 && link.capabilities.port == 0xabcd);
    }
}

/* At the start of the firmware the gateware is stopped before it may receive messages. */
static void test_init_waits(void)
{
    expect_capabilities(&usual);
    expect_stop(&usual);
    expect_read("send_status", RUNNING | REPLYING);
    expect_read("send_status", RUNNING | REPLYING);
    expect_read("send_status", REPLYING);
    expect_read("send_status", REPLYING);
    expect_read("send_status", 0);
    expect_closing();
    expect_read("stream_status", STREAM_OPEN | STREAM_SENDING);
    expect_read("stream_status", STREAM_SENDING);
    expect_read("stream_status", 0);
    expect_read("slot_status", WRITING | 2u << 4);
    expect_read("slot_status", 0);
    expect_start(7);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_OK);
    require_all_done();
}

/* Expects reads of a register that never changes, until the timeout; the clock advances fast, so they are few. */
static void expect_patience(const char *name, uint32_t value)
{
    mock_clock_step = PATIENCE / 2;
    expect_read(name, value);
    expect_read(name, value);
    expect_read(name, value);
}

static void test_init_gives_up(void)
{
    expect_capabilities(&usual);
    expect_stop(&usual);
    expect_patience("send_status", RUNNING);
    expect_read("send_status", 0);
    expect_closing();
    expect_read("stream_status", 0);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_TIMEOUT);
    require_all_done();
    expect_capabilities(&usual);
    expect_stop(&usual);
    expect_read("send_status", 0);
    expect_patience("send_status", REPLYING);
    expect_closing();
    expect_read("stream_status", 0);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_TIMEOUT);
    require_all_done();
    expect_capabilities(&usual);
    expect_stop(&usual);
    expect_read("send_status", 0);
    expect_read("send_status", 0);
    expect_closing();
    expect_patience("stream_status", STREAM_SENDING);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_TIMEOUT);
    require_all_done();
    expect_capabilities(&usual);
    expect_stop(&usual);
    expect_read("send_status", 0);
    expect_read("send_status", 0);
    expect_closing();
    expect_read("stream_status", 0);
    expect_patience("slot_status", WRITING);
    REQUIRE(frame_link_init(&link, mailbox) == STATUS_TIMEOUT);
    require_all_done();
}

/* The token is 0 while the peer changes. */
static void test_session(void)
{
    set_up();
    expect_write("token", 0);
    expect_write("peer_address", 0xc0a80164);
    expect_write("peer_port", 0xabcd);
    expect_write("token", 0x12345678);
    REQUIRE(frame_link_set_session(&link, 0x12345678, &peer) == STATUS_OK);
    require_all_done();
    expect_write("token", 0);
    expect_write("peer_address", 0xc0a80164);
    expect_write("peer_port", 0xabcd);
    REQUIRE(frame_link_set_session(&link, 0, &peer) == STATUS_OK);
    require_all_done();
}

static void expect_open(uint32_t slot, uint32_t pixels)
{
    expect_write("slot_frame_id", 0x87654321);
    expect_write("slot_base", 0x40010000);
    expect_write("slot_pixels", pixels);
    expect_call("memory_to_device");
    expect_write("slot_control", slot | 1u << 8);
}

static void test_open(void)
{
    set_up();
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        expect_read("slot_status", WRITING);
        expect_open(slot, 48 * 1024);
        expect_read("slot_status", 0);
        REQUIRE(frame_link_open_slot(&link, slot, 0x87654321, address(0x40010000), 48 * 1024) == STATUS_OK);
        require_all_done();
    }
    /* Waits until the previous slot is ready, and until this one is. */
    expect_read("slot_status", CLEARING);
    expect_read("slot_status", CLEARING | WRITING);
    expect_read("slot_status", 0);
    expect_open(1, 1);
    expect_read("slot_status", CLEARING);
    expect_read("slot_status", WRITING | 1u << 4);
    REQUIRE(frame_link_open_slot(&link, 1, 0x87654321, address(0x40010000), 1) == STATUS_OK);
    require_all_done();
    expect_patience("slot_status", CLEARING);
    REQUIRE(frame_link_open_slot(&link, 1, 0x87654321, address(0x40010000), 1) == STATUS_TIMEOUT);
    require_all_done();
    expect_read("slot_status", 0);
    expect_open(2, 1);
    expect_patience("slot_status", CLEARING);
    expect_write("slot_control", 2 | 1u << 9);
    REQUIRE(frame_link_open_slot(&link, 2, 0x87654321, address(0x40010000), 1) == STATUS_TIMEOUT);
    require_all_done();
}

/* For each size of the slot table: its largest frame, and one with a pixel, a chunk or more than a register too much. */
static void test_largest_frame(void)
{
    for (uint32_t chunks = 32; chunks <= 8192; chunks += 32) {
        built_t  built = {FRAME_LINK_VERSION, SLOTS, chunks, 8, 16};
        uint32_t most  = chunks / 2 * 1024;

        set_up_built(&built, 0);
        for (uint32_t less = 0; less < 2; less++) {
            expect_read("slot_status", 0);
            expect_open(0, most - less);
            expect_read("slot_status", 0);
            REQUIRE(frame_link_open_slot(&link, 0, 0x87654321, address(0x40010000), most - less) == STATUS_OK);
            require_all_done();
        }
        REQUIRE(frame_link_open_slot(&link, 0, 1, address(0x40010000), most + 1) == STATUS_SIZE);
        REQUIRE(frame_link_open_slot(&link, 0, 1, address(0x40010000), most + 1024) == STATUS_SIZE);
        REQUIRE(frame_link_open_slot(&link, 0, 1, address(0x40010000), UINT32_MAX - 1023) == STATUS_SIZE);
        REQUIRE(frame_link_open_slot(&link, 0, 1, address(0x40010000), UINT32_MAX) == STATUS_SIZE);
    }
}

static void test_close(void)
{
    set_up();
    expect_write("slot_control", 2 | 1u << 9);
    expect_read("slot_status", CLEARING);
    expect_call("memory_from_device");
    REQUIRE(frame_link_close_slot(&link, 2) == STATUS_OK);
    require_all_done();
    /* It waits for a chunk of this slot, */
    expect_write("slot_control", 1 | 1u << 9);
    expect_read("slot_status", WRITING | 1u << 4);
    expect_read("slot_status", WRITING | 1u << 4);
    expect_read("slot_status", 1u << 4);
    expect_call("memory_from_device");
    REQUIRE(frame_link_close_slot(&link, 1) == STATUS_OK);
    require_all_done();
    /* but not for one of another. */
    for (uint32_t other = 0; other < 16; other++) {
        expect_write("slot_control", 1 | 1u << 9);
        expect_read("slot_status", WRITING | 1u << 4);
        expect_read("slot_status", (other == 1 ? 0 : WRITING) | other << 4);
        expect_call("memory_from_device");
        REQUIRE(frame_link_close_slot(&link, 1) == STATUS_OK);
        require_all_done();
    }
    expect_write("slot_control", 1 | 1u << 9);
    expect_patience("slot_status", WRITING | 1u << 4);
    REQUIRE(frame_link_close_slot(&link, 1) == STATUS_TIMEOUT);
    require_all_done();
}

static void test_arrived(void)
{
    set_up();
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        for (uint32_t word = 0; word < 3; word++) {
            expect_write("arrived_index", 3 * slot + word);
            expect_read("arrived", 0x80000001 + word);
            REQUIRE(frame_link_arrived(&link, slot, word) == 0x80000001 + word);
        }
    }
    require_all_done();
}

static void put_mail(unsigned entry, uint16_t length)
{
    uint8_t *at = mailbox + entry * FRAME_LINK_ENTRY_SIZE;

    put_u32(at, 0xc0a80100 + entry);
    put_u16(at + 4, (uint16_t)(0x8000 + entry));
    put_u16(at + 6, length);
}

static void require_mail(unsigned entry, size_t length)
{
    frame_link_message_t received;

    REQUIRE(frame_link_peek(&link, &received) == STATUS_OK);
    REQUIRE(received.peer.udp && received.peer.address == 0xc0a80100 + entry && received.peer.port == 0x8000 + entry);
    REQUIRE(received.length == length && received.bytes == mailbox + entry * FRAME_LINK_ENTRY_SIZE + 8);
    require_all_done();
}

/* Messages come out in order; caches are flushed once for all that have arrived, and again for later ones. */
static void test_mailbox(void)
{
    frame_link_message_t received;

    set_up_built(&usual, 253);
    put_mail(5, 28);
    put_mail(6, 1052);
    put_mail(7, 29);
    put_mail(0, 30);
    expect_read("mailbox_produced", 253);
    REQUIRE(frame_link_peek(&link, &received) == STATUS_IDLE);
    expect_read("mailbox_produced", 0);
    expect_call("memory_from_device");
    require_mail(5, 28);
    require_mail(5, 28);
    expect_write("mailbox_consumed", 254);
    frame_link_drop(&link);
    require_mail(6, 1052);
    expect_write("mailbox_consumed", 255);
    frame_link_drop(&link);
    require_mail(7, 29);
    expect_write("mailbox_consumed", 0);
    frame_link_drop(&link);
    frame_link_drop(&link);
    require_all_done();
    expect_read("mailbox_produced", 1);
    expect_call("memory_from_device");
    require_mail(0, 30);
    expect_write("mailbox_consumed", 1);
    frame_link_drop(&link);
    expect_read("mailbox_produced", 1);
    REQUIRE(frame_link_peek(&link, &received) == STATUS_IDLE);
    require_all_done();
    /* A length beyond the entry is limited. */
    put_mail(1, 0xffff);
    expect_read("mailbox_produced", 2);
    expect_call("memory_from_device");
    require_mail(1, FRAME_LINK_ENTRY_SIZE - 8);
}

/* A mailbox of fewer entries wraps around sooner. */
static void test_small_mailbox(void)
{
    built_t built = usual;

    built.entries = 2;
    set_up_built(&built, 3);
    put_mail(1, 28);
    put_mail(0, 29);
    expect_read("mailbox_produced", 5);
    expect_call("memory_from_device");
    require_mail(1, 28);
    expect_write("mailbox_consumed", 4);
    frame_link_drop(&link);
    require_mail(0, 29);
}

static void expect_message(const message_t *message, uint32_t how)
{
    expect_read("send_status", how == 1 ? RUNNING : REPLYING);
    expect_write("send_address", 0xc0a80164);
    expect_write("send_port", 0xabcd);
    expect_write("send_type", message->type);
    expect_write("send_session", message->session);
    expect_write("send_sequence", message->sequence);
    expect_write("send_frame_id", message->frame_id);
    expect_write("send_offset", message->offset);
    expect_write("send_base", 0x40020010);
    expect_write("send_length", message->length);
    expect_call("memory_to_device");
    expect_write("send_control", how);
}

/* Replies and bursts do not wait for each other, and neither starts while one of its kind is busy. */
static void test_send(void)
{
    message_t message = {
        .type = 0x87, .session = 0x11111111, .sequence = 0x22222222, .frame_id = 0x33333333, .offset = 0x44444400,
        .length = PROTOCOL_CHUNK_SIZE, .payload = address(0x40020010),
    };

    set_up();
    expect_message(&message, 1);
    REQUIRE(frame_link_reply(&link, &peer, &message) == STATUS_OK);
    expect_read("send_status", REPLYING);
    REQUIRE(frame_link_reply(&link, &peer, &message) == STATUS_BUSY);
    message.length = 0;
    expect_message(&message, 1);
    REQUIRE(frame_link_reply(&link, &peer, &message) == STATUS_OK);
    require_all_done();
    message.length = 0x12345;
    expect_message(&message, 2);
    REQUIRE(frame_link_send_burst(&link, &peer, &message) == STATUS_OK);
    expect_read("send_status", RUNNING);
    REQUIRE(frame_link_send_burst(&link, &peer, &message) == STATUS_BUSY);
    require_all_done();
    for (uint32_t status = 0; status < 4; status++) {
        expect_read("send_status", status);
        REQUIRE(frame_link_reply_busy(&link) == ((status & REPLYING) != 0));
        expect_read("send_status", status);
        REQUIRE(frame_link_burst_busy(&link) == ((status & RUNNING) != 0));
    }
    require_all_done();
}

static void test_abort(void)
{
    set_up();
    expect_write("send_control", 4);
    expect_read("send_status", RUNNING);
    expect_read("send_status", RUNNING | REPLYING);
    expect_read("send_status", REPLYING);
    REQUIRE(frame_link_abort_burst(&link) == STATUS_OK);
    require_all_done();
    expect_write("send_control", 4);
    expect_patience("send_status", RUNNING);
    REQUIRE(frame_link_abort_burst(&link) == STATUS_TIMEOUT);
    require_all_done();
}

static void expect_counter(uint32_t index, uint32_t value)
{
    expect_write("counter_index", index);
    expect_read("counter", value);
}

static void test_count(void)
{
    frame_link_counters_t counters;

    set_up();
    expect_counter(0, 101);
    expect_counter(15, 102);
    expect_counter(1, 103);
    expect_counter(8, 104);
    expect_counter(9, 105);
    expect_counter(10, 106);
    expect_counter(11, 107);
    expect_counter(12, 108);
    expect_counter(13, 109);
    expect_counter(14, 110);
    frame_link_count(&link, &counters);
    require_all_done();
    REQUIRE(counters.datagrams_received == 101 && counters.datagrams_sent == 102);
    REQUIRE(counters.datagrams_malformed == 103 && counters.datagrams_overrun == 104);
    REQUIRE(counters.mailbox_overrun == 105 && counters.uploads_foreign == 106 && counters.uploads_unfit == 107);
    REQUIRE(counters.chunks_received == 108 && counters.chunks_repeated == 109);
    REQUIRE(counters.chunks_while_matching == 110);
}

int main(void)
{
    test_bad_arguments();
    test_init();
    test_init_waits();
    test_init_gives_up();
    test_session();
    test_open();
    test_largest_frame();
    test_close();
    test_arrived();
    test_mailbox();
    test_small_mailbox();
    test_send();
    test_abort();
    test_count();
    return 0;
}
