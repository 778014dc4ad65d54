/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The protocol over UDP: driver, link and session on gateware in software. */

#include <string.h>

#include "fake_frame_link.h"
#include "fixture.h"
#include "link/udp/udp_link.h"
#include "litestereo/platform.h"
#include "require.h"

#define DATAGRAMS 256

static const peer_t alice = {.udp = true, .address = 0xc0a80164, .port = 5000};
static const peer_t bob   = {.udp = true, .address = 0xc0a80165, .port = 5000};

static frame_link_t driver;
static udp_link_t   udp;
static uint64_t     ticks;
static uint64_t     wakes;     /* Tick at which hanging gateware continues. */
static uint32_t     sequence;  /* Of the last message posted. */

static _Alignas(FRAME_LINK_MAX_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];
static _Alignas(FRAME_ALIGNMENT) uint8_t reply_payload[PROTOCOL_CHUNK_SIZE];

/* Datagrams sent and not yet checked, oldest first. */
static struct {
    peer_t    to;
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX];
    message_t message;
} sent[DATAGRAMS];
static unsigned sent_first, sent_last;
static unsigned room;  /* Parts of maps that the wire accepts before it blocks. */

uint64_t clock_now(void)
{
    ticks += 1000;
    if (wakes != 0 && ticks >= wakes) {
        fake_frame_link.hang = false;
        wakes                = 0;
    }
    fake_frame_link_advance();
    return ticks;
}

void memory_to_device(void)   {}
void memory_from_device(void) {}

static bool send_datagram(const peer_t *to, const uint8_t *bytes, size_t length)
{
    if (bytes[HEADER_TYPE] == (TYPE_READ | PROTOCOL_REPLY_BIT)) {
        if (room == 0) {
            return false;
        }
        room--;
    }
    REQUIRE(sent_last < DATAGRAMS);
    sent[sent_last].to = *to;
    memcpy(sent[sent_last].bytes, bytes, length);
    REQUIRE(message_parse(sent[sent_last].bytes, length, &sent[sent_last].message) == STATUS_OK);
    sent_last++;
    return true;
}

/* Delivers a message of a peer. */
static void post_as(const peer_t *who, uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload,
    uint32_t length)
{
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX];
    message_t message = {
        .version = PROTOCOL_VERSION, .type = type, .session = token, .sequence = ++sequence, .frame_id = frame_id,
        .offset = offset, .length = length, .payload = payload,
    };

    fake_frame_link_receive(who, bytes, message_build(&message, bytes));
}

static void post(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length)
{
    post_as(&alice, type, frame_id, offset, payload, length);
}

static void step(void)
{
    udp_link_poll(&udp, clock_now());
}

/* The oldest datagram sent, which must be for `who`. */
static const message_t *take_as(const peer_t *who)
{
    REQUIRE(sent_first < sent_last && peer_is(&sent[sent_first].to, who));
    return &sent[sent_first++].message;
}

static const message_t *take(uint8_t type)
{
    const message_t *message = take_as(&alice);

    REQUIRE(message->type == type && message->session == token && message->version == PROTOCOL_VERSION);
    return message;
}

static void require_quiet(void)
{
    for (int i = 0; i < 10; i++) {
        step();
    }
    REQUIRE(sent_first == sent_last);
    sent_first = sent_last = 0;
}

/* Sends a request and gets the only answer. */
static const message_t *converse(uint8_t type, uint32_t frame_id, const void *payload, uint32_t length)
{
    const message_t *message;

    require_quiet();
    post(type, frame_id, 0, payload, length);
    step();
    clock_now();
    message = take_as(&alice);
    REQUIRE(message->sequence == sequence && message->frame_id == frame_id && message->offset == 0);
    REQUIRE(sent_first == sent_last);
    return message;
}

static void greet(const peer_t *who, uint32_t nonce)
{
    uint8_t payload[4];

    put_u32(payload, nonce);
    token = 0;
    post_as(who, TYPE_HELLO, 0, 0, payload, 4);
    step();
    clock_now();
    token = get_u32(take_as(who)->payload);
    REQUIRE(token != 0);
}

static void start(void)
{
    set_up();
    ticks = wakes = 0;
    sent_first = sent_last = 0;
    room                     = UINT32_MAX;
    fake_frame_link.version  = FRAME_LINK_VERSION;
    fake_frame_link.send     = send_datagram;
    fake_frame_link.hang     = false;
    fake_frame_link_reset();
    memset(mailbox, CANARY, sizeof(mailbox));
    REQUIRE(frame_link_init(&driver, mailbox) == STATUS_OK);
    REQUIRE(udp_link_init(&udp, &driver, &session, &counters, reply_payload) == STATUS_OK);
    REQUIRE(session.transfer == &udp.transfer && udp.transfer.max_pixels == fake_frame_link.max_chunks * 512u);
    greet(&alice, 1);
}

static frame_t *open_by_udp(uint32_t frame_id, uint16_t width, uint16_t height)
{
    uint8_t  payload[4];
    frame_t *frame;

    session.settings.disparities = 16;
    session.settings.block_size  = 5;
    put_u16(payload, width);
    put_u16(payload + 2, height);
    REQUIRE(converse(TYPE_OPEN, frame_id, payload, 4)->type == 0x83);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, frame_id);
    REQUIRE(frame != NULL && frame->state == FRAME_LOADING);
    return frame;
}

static uint8_t chunk_byte(uint32_t frame_id, uint32_t at)
{
    return (uint8_t)(at * 7 + at / 1024 * 13 + frame_id);
}

static void post_chunk(const frame_t *frame, uint32_t offset)
{
    uint8_t chunk[PROTOCOL_CHUNK_SIZE];

    for (uint32_t i = 0; i < sizeof(chunk); i++) {
        chunk[i] = chunk_byte(frame->id, offset + i);
    }
    post(TYPE_UPLOAD, frame->id, offset, chunk, frame_chunk_length(frame, offset));
}

/* A frame that was uploaded over UDP and is DONE, with a distinct map. */
static frame_t *make_done(uint32_t frame_id)
{
    frame_t *frame = open_by_udp(frame_id, 180, 100);

    for (uint32_t chunk = 0; chunk < frame_chunks(frame); chunk++) {
        post_chunk(frame, chunk * PROTOCOL_CHUNK_SIZE);
    }
    REQUIRE(converse(TYPE_START, frame_id, NULL, 0)->type == 0x85 && frame->state == FRAME_READY);
    REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    REQUIRE(frame_finish(frame, &(frame_result_t){.clocks = 1}) == STATUS_OK);
    for (uint32_t i = 0; i < frame_map_size(frame); i++) {
        frame_map(frame)[i] = (uint8_t)(i * 11 + i / 1024 + frame_id * 3);
    }
    return frame;
}

static void post_read(uint32_t frame_id, uint32_t offset, uint32_t length)
{
    uint8_t payload[4];

    put_u32(payload, length);
    post(TYPE_READ, frame_id, offset, payload, 4);
}

/* Requires that the next datagrams are the replies to a READ. */
static void require_run(const frame_t *frame, uint32_t of, uint32_t offset, uint32_t length)
{
    uint32_t end = offset + length;

    for (; offset < end; offset += PROTOCOL_CHUNK_SIZE) {
        const message_t *part = take(0x87);

        REQUIRE(part->sequence == of && part->frame_id == frame->id && part->offset == offset);
        REQUIRE(part->length == (end - offset < PROTOCOL_CHUNK_SIZE ? end - offset : PROTOCOL_CHUNK_SIZE));
        REQUIRE(memcmp(part->payload, frame_map(frame) + offset, part->length) == 0);
    }
}

/* Takes the datagram with this sequence out of those that were sent; they must be of this frame. Replies may overtake the
 * parts of READs, which keep their order. */
static const message_t *take_part(uint32_t of, uint32_t frame_id)
{
    for (unsigned i = sent_first; i < sent_last; i++) {
        if (sent[i].message.sequence == of) {
            static message_t taken;

            taken = sent[i].message;
            REQUIRE(taken.frame_id == frame_id);
            sent_last--;
            memmove(&sent[i], &sent[i + 1], (sent_last - i) * sizeof(sent[0]));
            return &taken;
        }
    }
    REQUIRE(!"a datagram of this sequence");
    return NULL;
}

static void steps(unsigned count)
{
    while (count-- > 0) {
        step();
    }
}

static void test_upload(void)
{
    frame_t         *frame;
    const message_t *reply_of;

    start();
    frame = open_by_udp(7, 180, 100);  /* 18 chunks per image; the last has 592 bytes. */
    for (uint32_t chunk = 36; chunk-- > 0;) {
        if (chunk != 33) {
            post_chunk(frame, chunk * 1024);
            post_chunk(frame, chunk * 1024);
        }
    }
    reply_of = converse(TYPE_MISSING, 7, NULL, 0);
    REQUIRE(reply_of->type == 0x8b && reply_of->length == 5 && memcmp(reply_of->payload, "\0\0\0\0\2", 5) == 0);
    reply_of = converse(TYPE_STATUS, 7, NULL, 0);
    REQUIRE(reply_of->payload[0] == FRAME_LOADING && get_u32(reply_of->payload + 12) == 33 * 1024);
    REQUIRE(converse(TYPE_START, 7, NULL, 0)->type == TYPE_ERROR && frame->state == FRAME_LOADING);
    post_chunk(frame, 33 * 1024);
    REQUIRE(converse(TYPE_START, 7, NULL, 0)->type == 0x85 && frame->state == FRAME_READY);
    for (uint32_t i = 0; i < 2 * frame->pitch; i++) {
        REQUIRE(frame->memory[i] == (i % frame->pitch < 18000 ? chunk_byte(7, i) : CANARY));
    }
    /* A started frame accepts no chunks: its memory is the matcher's. */
    save_memory();
    post_chunk(frame, 0);
    clock_now();
    require_untouched();
    reply_of = converse(TYPE_STATISTICS, 0, NULL, 0);
    REQUIRE(get_u32(reply_of->payload + 4 * COUNTER_CHUNKS_RECEIVED) == 36);
    REQUIRE(get_u32(reply_of->payload + 4 * COUNTER_CHUNKS_REPEATED) == 35);
    REQUIRE(get_u32(reply_of->payload + 4 * COUNTER_UPLOADS_UNFIT) == 1);
    REQUIRE(get_u32(reply_of->payload + 4 * COUNTER_DATAGRAMS_RECEIVED) == 1 + 1 + 70 + 3 + 1 + 1 + 1 + 1);
    REQUIRE(get_u32(reply_of->payload + 4 * COUNTER_DATAGRAMS_SENT) == 6);
    /* A later frame in the slot has no chunks at first. */
    REQUIRE(converse(TYPE_RELEASE, 7, NULL, 0)->type == 0x88);
    frame = open_by_udp(8, 180, 100);
    REQUIRE(memcmp(converse(TYPE_MISSING, 8, NULL, 0)->payload, "\xff\xff\xff\xff\x0f", 5) == 0);
}

/* Rejected chunks write nothing and are counted by reason. */
static void test_wrong_chunks(void)
{
    static const uint8_t chunk[PROTOCOL_CHUNK_SIZE];
    frame_t *frame;
    uint32_t mine, unfit = 0;

    start();
    frame = open_by_udp(7, 61, 43);
    mine  = token;
    save_memory();
    for (uint32_t offset = 0; offset <= 8 * 1024; offset += 512) {
        for (uint32_t length = 0; length <= 1024; length++) {
            if (length != frame_chunk_length(frame, offset) || length == 0) {
                post(TYPE_UPLOAD, 7, offset, chunk, length);
                unfit++;
            }
        }
    }
    post(TYPE_UPLOAD, 7, 0xfffffc00, chunk, 1024);
    post(TYPE_UPLOAD, 8, 0, chunk, 1024);
    token = mine + 1;
    post(TYPE_UPLOAD, 7, 0, chunk, 1024);
    token = 0;
    post(TYPE_UPLOAD, 7, 0, chunk, 1024);
    token = mine;
    post_as(&bob, TYPE_UPLOAD, 7, 0, chunk, 1024);
    post_as(&(peer_t){.udp = true, .address = alice.address, .port = 5001}, TYPE_UPLOAD, 7, 0, chunk, 1024);
    REQUIRE(converse(TYPE_BYE, 0, NULL, 0)->type == 0x8a);
    post(TYPE_UPLOAD, 7, 0, chunk, 1024);
    token = 0;
    post(TYPE_UPLOAD, 7, 0, chunk, 1024);
    require_quiet();
    require_untouched();
    session_update_counters(&session, ticks);
    REQUIRE(counters.value[COUNTER_UPLOADS_UNFIT] == unfit + 2 && counters.value[COUNTER_UPLOADS_FOREIGN] == 6);
    REQUIRE(counters.value[COUNTER_CHUNKS_RECEIVED] == 0);
}

/* Gateware's counts are added to the firmware's, once. */
static void test_counters(void)
{
    frame_t *frame;

    start();
    counters.value[COUNTER_CHUNKS_RECEIVED] = 1000;
    counters.value[COUNTER_CHUNKS_REPEATED] = 2000;
    frame = open_by_udp(7, 61, 43);
    post_chunk(frame, 0);
    post_chunk(frame, 0);
    for (int i = 0; i < 3; i++) {
        clock_now();
        session_update_counters(&session, ticks);
        REQUIRE(counters.value[COUNTER_CHUNKS_RECEIVED] == 1001 && counters.value[COUNTER_CHUNKS_REPEATED] == 2001);
        REQUIRE(counters.value[COUNTER_DATAGRAMS_RECEIVED] == 4 && counters.value[COUNTER_DATAGRAMS_SENT] == 2);
    }
    fake_frame_link_receive(&alice, mailbox, 20);
    session_update_counters(&session, ticks);
    REQUIRE(counters.value[COUNTER_DATAGRAMS_MALFORMED] == 1);
}

/* The payload of a reply does not change until gateware has read it; requests wait. */
static void test_reply_is_not_rewritten(void)
{
    const message_t *first, *second;

    start();
    open_by_udp(7, 180, 100);
    post(TYPE_STATUS, 7, 0, NULL, 0);
    post(TYPE_MISSING, 7, 0, NULL, 0);
    fake_frame_link.hang = true;
    steps(10);
    REQUIRE(sent_first == sent_last && fake_frame_link_waiting() == 1);
    fake_frame_link.hang = false;
    steps(3);
    first = take(0x86);
    REQUIRE(first->sequence == sequence - 1 && first->length == 16 && first->payload[0] == FRAME_LOADING);
    second = take(0x8b);
    REQUIRE(second->sequence == sequence && memcmp(second->payload, "\xff\xff\xff\xff\x0f", 5) == 0);
}

static void test_full_mailbox(void)
{
    uint32_t first;

    start();
    first = sequence + 1;
    for (int i = 0; i < 11; i++) {
        post(TYPE_STATUS, 7, 0, NULL, 0);
    }
    steps(20);
    for (uint32_t i = 0; i < 8; i++) {
        REQUIRE(take(0x86)->sequence == first + i);
    }
    require_quiet();
    session_update_counters(&session, ticks);
    REQUIRE(counters.value[COUNTER_MAILBOX_OVERRUN] == 3);
    /* Its entries are reused many times. */
    for (int i = 0; i < 600; i++) {
        REQUIRE(converse(TYPE_STATUS, 7, NULL, 0)->type == 0x86);
    }
}

/* A refused peer gets the error itself; bytes that are not a message are counted and dropped. */
static void test_others(void)
{
    const message_t *message;

    start();
    post_as(&bob, TYPE_STATUS, 7, 0, NULL, 0);
    steps(2);
    message = take_as(&bob);
    REQUIRE(message->type == TYPE_ERROR && get_u16(message->payload) == ERROR_BUSY);
    post(TYPE_STATUS, 7, 0, NULL, 0);
    for (unsigned entry = 0; entry < 8; entry++) {
        mailbox[entry * 2048 + 8 + HEADER_FRAME_ID] ^= 1;
    }
    require_quiet();
    REQUIRE(counters.value[COUNTER_CRC_ERRORS] == 1);
    post(TYPE_STATUS, 7, 0, NULL, 0);
    for (unsigned entry = 0; entry < 8; entry++) {
        mailbox[entry * 2048 + 8 + HEADER_MAGIC] ^= 1;
    }
    require_quiet();
    REQUIRE(counters.value[COUNTER_HEADER_ERRORS] == 1);
    post(0x86, 7, 0, NULL, 0);
    require_quiet();
    REQUIRE(counters.value[COUNTER_HEADER_ERRORS] == 2);
    REQUIRE(converse(TYPE_STATUS, 7, NULL, 0)->type == 0x86);
}

/* READs of any length, one after the other, with other replies in between. */
static void test_reads(void)
{
    static const uint32_t ranges[][2] = {
        {0, 36000}, {0, 1}, {1024, 1024}, {2048, 1025}, {34816, 1184}, {35840, 160}, {0, 1023}, {5120, 8192},
    };
    frame_t *frame;
    uint32_t first;

    start();
    frame = make_done(7);
    require_quiet();
    first = sequence + 1;
    room  = 0;
    for (int i = 0; i < 8; i++) {
        post_read(7, ranges[i][0], ranges[i][1]);
    }
    steps(3);
    /* Eight are queued, and no more. */
    post_read(7, 0, 1);
    post(TYPE_STATUS, 7, 0, NULL, 0);
    steps(3);
    REQUIRE(get_u16(take(TYPE_ERROR)->payload) == ERROR_BUSY && take(0x86)->payload[0] == FRAME_DONE);
    require_quiet();
    room = 3;
    steps(3);
    require_run(frame, first, 0, 3 * 1024);
    post(TYPE_STATUS, 7, 0, NULL, 0);
    steps(3);
    take(0x86);
    require_quiet();
    room = UINT32_MAX;
    steps(40);
    for (uint32_t offset = 3 * 1024; offset < 36000; offset += 1024) {
        require_run(frame, first, offset, 36000 - offset < 1024 ? 36000 - offset : 1024);
    }
    for (uint32_t i = 1; i < 8; i++) {
        require_run(frame, first + i, ranges[i][0], ranges[i][1]);
    }
    require_quiet();
    /* And the queue is empty again. */
    for (int i = 0; i < 8; i++) {
        post_read(7, 0, 36000);
        steps(5);
        require_run(frame, sequence, 0, 36000);
        require_quiet();
    }
}

/* READs of a frame are dropped with it, including the one being sent; those of other frames are served. */
static void test_release_in_a_run(void)
{
    frame_t *one, *other;
    uint32_t kept;

    start();
    one   = make_done(7);
    other = make_done(8);
    require_quiet();
    room = 2;
    post_read(7, 0, 36000);
    post_read(7, 1024, 2048);
    post_read(8, 2048, 3000);
    kept = sequence;
    post_read(7, 0, 1);
    post_read(8, 0, 1);
    steps(3);
    require_run(one, kept - 2, 0, 2048);
    post(TYPE_RELEASE, 7, 0, NULL, 0);
    step();
    REQUIRE(one->state == FRAME_EMPTY);
    /* The slot is free, so nothing of it is sent. */
    memset(one->memory, CANARY, 4 * 18000);
    room = UINT32_MAX;
    steps(10);
    take(0x88);
    require_run(other, kept, 2048, 3000);
    require_run(other, kept + 2, 0, 1);
    require_quiet();
}

/* Any frame may be released while any frame's READ is being sent: the READs of the other frames are served in order and
 * whole, also the one that is being sent. */
static void test_release_beside_a_run(void)
{
    uint32_t seed = 1;

    for (unsigned round = 0; round < 600; round++) {
        unsigned count    = 1 + round % PROTOCOL_QUEUED_READS;
        uint32_t released = 7 + round / PROTOCOL_QUEUED_READS % 2;
        uint32_t sent_before, of[PROTOCOL_QUEUED_READS], frame_of[PROTOCOL_QUEUED_READS];
        frame_t *frame[2];

        start();
        frame[0] = make_done(7);
        frame[1] = make_done(8);
        require_quiet();
        seed        = seed * 1664525u + 1013904223u;
        sent_before = (seed >> 28) % 6;
        room        = sent_before;
        for (unsigned i = 0; i < count; i++) {
            frame_of[i] = 7 + (seed >> (8 + i) & 1);
            post_read(frame_of[i], 0, 5000);
            of[i] = sequence;
        }
        steps(3);
        post(TYPE_RELEASE, released, 0, NULL, 0);
        step();
        REQUIRE(frame[released - 7]->state == FRAME_EMPTY && frame[8 - released]->state == FRAME_DONE);
        room = UINT32_MAX;
        steps(20);
        /* Of the first READ some parts were sent before the release, of one more frame that is its whole answer. */
        for (unsigned i = 0, parts = 0; i < count; i++) {
            uint32_t have = sent_before > parts ? sent_before - parts : 0;

            parts += 5;
            if (frame_of[i] == released) {
                uint32_t length = have * PROTOCOL_CHUNK_SIZE < 5000 ? have * PROTOCOL_CHUNK_SIZE : 5000;

                for (uint32_t offset = 0; offset < length; offset += PROTOCOL_CHUNK_SIZE) {
                    REQUIRE(take_part(of[i], released)->offset == offset);
                }
            } else {
                for (uint32_t offset = 0; offset < 5000; offset += PROTOCOL_CHUNK_SIZE) {
                    REQUIRE(take_part(of[i], frame_of[i])->offset == offset);
                }
            }
        }
        REQUIRE(take_part(sequence, released)->type == 0x88);
        require_quiet();
        REQUIRE(udp.queued == 0 && !udp.sending);
    }
}

static void test_end_of_session_in_a_run(void)
{
    for (int how = 0; how < 3; how++) {
        start();
        make_done(7);
        make_done(8);
        require_quiet();
        room = 1;
        for (int i = 0; i < 4; i++) {
            post_read(7, 0, 36000);
            post_read(8, 0, 36000);
        }
        steps(3);
        take(0x87);
        room = UINT32_MAX;
        fake_frame_link.hang = true;  /* So that the burst does not end. */
        wakes = ticks + 20000;
        if (how == 0) {
            post(TYPE_BYE, 0, 0, NULL, 0);
            steps(30);
            take(0x8a);
        } else if (how == 1) {
            uint32_t before = token;

            post(TYPE_HELLO, 0, 0, "\2\0\0", 4);
            steps(30);
            REQUIRE(take_as(&alice)->type == 0x81 && token == before);
        } else {
            session_update_counters(&session, ticks);  /* Earlier chunks do not count as a sign of life at the HELLO. */
            ticks += 5ull * device_info.sys_clk_hz;
            wakes = ticks + 20000;
            post_as(&bob, TYPE_HELLO, 0, 0, "\2\0\0", 4);
            steps(30);
            REQUIRE(take_as(&bob)->type == 0x81);
        }
        require_quiet();
        REQUIRE(udp.queued == 0 && !udp.sending);
        for (unsigned slot = 0; slot < SLOTS; slot++) {
            REQUIRE(pool.frame[slot].state == FRAME_EMPTY);
        }
    }
}

/* Gateware that does not stop costs a bounded wait; the next READ is served once it does. */
static void test_stuck_run(void)
{
    frame_t *other;
    uint64_t before;

    start();
    make_done(7);
    other = make_done(8);
    require_quiet();
    room = 0;
    post_read(7, 0, 36000);
    post_read(8, 0, 2000);
    steps(2);
    post(TYPE_RELEASE, 7, 0, NULL, 0);
    fake_frame_link.hang = true;
    before = ticks;
    step();
    REQUIRE(ticks - before > 100000 && ticks - before < 300000 && pool.frame[0].state == FRAME_EMPTY);
    steps(3);
    fake_frame_link.hang = false;
    room                 = UINT32_MAX;
    steps(10);
    take(0x88);
    require_run(other, sequence - 1, 0, 2000);
    require_quiet();
}

/* A slot is not freed before a chunk on its way to it has arrived. */
static void test_release_waits_for_a_chunk(void)
{
    frame_t *frame;

    start();
    frame = open_by_udp(7, 61, 43);
    require_quiet();
    fake_frame_link.hang = true;
    post_chunk(frame, 1024);
    post(TYPE_RELEASE, 7, 0, NULL, 0);
    wakes = ticks + 50000;
    step();
    REQUIRE(frame->state == FRAME_EMPTY && ticks >= 50000);
    REQUIRE(frame->memory[1024] == chunk_byte(7, 1024));
    memset(frame->memory, CANARY, 3072);
    save_memory();
    steps(10);
    require_untouched();
    take(0x88);
}

/* OPEN is not answered before the slot accepts chunks. */
static void test_open_waits(void)
{
    uint8_t payload[4] = {100, 0, 50, 0};

    start();
    require_quiet();
    fake_frame_link.hang = true;
    wakes = ticks + 50000;
    post(TYPE_OPEN, 7, 0, payload, 4);
    steps(3);
    REQUIRE(take(0x83)->frame_id == 7);
    REQUIRE(ticks >= 50000);
    fake_frame_link.hang = true;
    post(TYPE_OPEN, 8, 0, payload, 4);
    step();
    fake_frame_link.hang = false;
    steps(3);
    REQUIRE(get_u16(take(TYPE_ERROR)->payload) == ERROR_TIMEOUT);
    REQUIRE(frame_pool_find(&pool, FRAME_OWNER_LINK, 8) == NULL);
}

/* The largest frame has half the chunks of gateware's table per image; a pixel more is refused before gateware is asked. */
static void test_largest_frame(void)
{
    /* Width and height with max_chunks / 2 x 1024 pixels, and with one more. */
    static const uint16_t most[][2] = {{128, 128}, {256, 64}, {1024, 16}}, more[][2] = {{145, 113}, {565, 29}, {3277, 5}};

    fake_frame_link.max_chunks = 32;
    for (unsigned i = 0; i < 3; i++) {
        uint8_t payload[4];

        start();
        REQUIRE(udp.transfer.max_pixels == 16384 && pool.max_pixels > 16385);
        REQUIRE(most[i][0] * most[i][1] == 16384 && more[i][0] * more[i][1] == 16385);
        REQUIRE(frame_chunks(open_by_udp(1, most[i][0], most[i][1])) == 32);
        put_u16(payload, more[i][0]);
        put_u16(payload + 2, more[i][1]);
        REQUIRE(converse(TYPE_OPEN, 2, payload, 4)->type == TYPE_ERROR);
        REQUIRE(get_u16(sent[0].message.payload) == ERROR_SIZE && get_u32(sent[0].message.payload + 4) == SIZE_TOO_LARGE);
        REQUIRE(frame_pool_find(&pool, FRAME_OWNER_LINK, 2) == NULL);
    }
    fake_frame_link.max_chunks = 1024;
}

static void test_too_few_slots(void)
{
    start();
    session.transfer          = NULL;
    driver.capabilities.slots = SLOTS - 1;
    REQUIRE(udp_link_init(&udp, &driver, &session, &counters, reply_payload) == STATUS_UNSUPPORTED && session.transfer == NULL);
}

int main(void)
{
    device_info.max_width = device_info.max_height = 4000;
    test_upload();
    test_wrong_chunks();
    test_counters();
    test_reply_is_not_rewritten();
    test_full_mailbox();
    test_others();
    test_reads();
    test_release_in_a_run();
    test_release_beside_a_run();
    test_end_of_session_in_a_run();
    test_stuck_run();
    test_release_waits_for_a_chunk();
    test_open_waits();
    test_largest_frame();
    test_too_few_slots();
    return 0;
}
