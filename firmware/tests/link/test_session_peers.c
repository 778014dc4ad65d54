/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Which peer a session belongs to, how long it is kept for it, and the calls of the transfer. */

#include <string.h>

#include "fixture.h"
#include "require.h"

#define HZ      60000000u  /* Of the fixture's device. */
#define SILENCE (5ull * HZ)

static const peer_t line  = {0};
static const peer_t alice = {.udp = true, .address = 0xc0a80164, .port = 5000};
static const peer_t bob   = {.udp = true, .address = 0xc0a80165, .port = 5000};
static const peer_t carol = {.udp = true, .address = 0xc0a80164, .port = 5001};

/* A transfer that only logs its calls. */
static struct {
    char           log[64];  /* A letter per call. */
    uint32_t       token;
    peer_t         peer;
    const frame_t *frame;
    uint32_t       arrived[2];  /* Found by refresh. */
    status_t       status;      /* Returned by open and close. */
    bool           full;
    uint32_t       sequence, length;
    uint32_t       chunks, repeated;  /* Found by the update of counters. */
} gateware;

static void note(void *context, char letter, const frame_t *frame)
{
    size_t length = strlen(gateware.log);

    REQUIRE(context == &gateware && length + 1 < sizeof(gateware.log));
    gateware.log[length]     = letter;
    gateware.log[length + 1] = 0;
    gateware.frame           = frame;
}

static void set_session(void *context, uint32_t session_token, const peer_t *who)
{
    note(context, 'b', NULL);
    gateware.token = session_token;
    gateware.peer  = *who;
}

static status_t open_frame_slot(void *context, const frame_t *frame)
{
    note(context, 'o', frame);
    return gateware.status;
}

static void refresh(void *context, frame_t *frame)
{
    note(context, 'r', frame);
    frame_mark_received(frame, 0, gateware.arrived[0]);
    frame_mark_received(frame, 1, gateware.arrived[1]);
}

static status_t close_frame_slot(void *context, const frame_t *frame)
{
    note(context, 'c', frame);
    return gateware.status;
}

static bool queue_read(void *context, const peer_t *who, const message_t *message, const frame_t *frame,
    uint32_t length)
{
    note(context, 'R', frame);
    REQUIRE(peer_is(who, &peer));
    gateware.sequence = message->sequence;
    gateware.length   = length;
    return !gateware.full;
}

static void forget(void *context, const frame_t *frame)
{
    REQUIRE(frame->state != FRAME_EMPTY && frame->state != FRAME_MATCHING);
    note(context, 'f', frame);
}

static void count_all(void *context)
{
    REQUIRE(context == &gateware);
    counters.value[COUNTER_CHUNKS_RECEIVED] += gateware.chunks;
    counters.value[COUNTER_CHUNKS_REPEATED] += gateware.repeated;
    gateware.chunks = gateware.repeated = 0;
}

static const session_transfer_t transfer = {
    .context = &gateware, .max_pixels = 5000, .set_session = set_session, .open_frame = open_frame_slot,
    .refresh = refresh, .close_frame = close_frame_slot,
    .queue_read = queue_read, .forget_frame = forget, .update_counters = count_all,
};

static void start(void)
{
    set_up();
    memset(&gateware, 0, sizeof(gateware));
    session.transfer = &transfer;
}

/* A session of a UDP peer, with an empty log. */
static void start_udp(void)
{
    start();
    peer = alice;
    hello(1);
    gateware.log[0] = 0;
}

static void require_log(const char *log)
{
    if (strcmp(gateware.log, log) != 0) {
        fprintf(stderr, "%s instead of %s\n", gateware.log, log);
    }
    REQUIRE(strcmp(gateware.log, log) == 0);
    gateware.log[0] = 0;
}

/* Sends a HELLO that is refused; returns the milliseconds to wait. */
static uint32_t refused_hello(const peer_t *who)
{
    static const uint8_t nonce[4] = {9};
    uint32_t             mine     = token;
    uint32_t             refused  = counters.value[COUNTER_SESSIONS_REFUSED];
    peer_t               before   = peer;

    peer  = *who;
    token = 0;
    REQUIRE(ask(TYPE_HELLO, 0, 0, nonce, 4) == TYPE_ERROR && get_u16(reply.payload) == ERROR_BUSY);
    REQUIRE(counters.value[COUNTER_SESSIONS_REFUSED] == refused + 1);
    peer  = before;
    token = mine;
    return get_u32(reply.payload + 4);
}

/* A session belongs to the sender of the HELLO, on the line or at an address and port. */
static void test_busy(void)
{
    static const peer_t *const peers[] = {&line, &alice, &bob, &carol};

    for (size_t mine = 0; mine < 4; mine++) {
        start();
        peer = *peers[mine];
        hello(1);
        make_frame(5, FRAME_LOADING);
        for (size_t other = 0; other < 4; other++) {
            if (other == mine) {
                continue;
            }
            REQUIRE(refused_hello(peers[other]) > 4999);
            peer = *peers[other];
            for (uint8_t type = TYPE_CONFIGURE; type <= TYPE_MISSING; type++) {
                if (type == TYPE_UPLOAD) {
                    continue;
                }
                ask(type, 5, 0, NULL, 0);
                REQUIRE(reply.type == TYPE_ERROR && get_u16(reply.payload) == ERROR_BUSY);
            }
            peer = *peers[mine];
        }
        REQUIRE(counters.value[COUNTER_SESSIONS_REFUSED] == 30 && counters.value[COUNTER_REQUESTS_REFUSED] == 30);
        REQUIRE(counters.value[COUNTER_SESSIONS] == 1 && counters.value[COUNTER_FRAMES_RECLAIMED] == 0);
        REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.payload[0] == FRAME_LOADING);
        /* Of one peer's HELLOs the newest wins. */
        hello(2);
        REQUIRE(counters.value[COUNTER_SESSIONS] == 2 && counters.value[COUNTER_FRAMES_RECLAIMED] == 1);
    }
}

/* BUSY is checked after version and type, and before the length of the payload. */
static void test_order_of_judgement(void)
{
    message_t message = {.version = 2, .type = TYPE_STATUS};
    uint8_t   payload[PROTOCOL_CHUNK_SIZE];

    start_udp();
    REQUIRE(session_handle(&session, uptime, &bob, &message, &reply, payload));
    require_error(ERROR_VERSION, 1);
    message.version = 1;
    message.type    = 0x0c;
    REQUIRE(session_handle(&session, uptime, &bob, &message, &reply, payload));
    require_error(ERROR_TYPE, 0x0c);
    message.type = TYPE_HELLO;
    REQUIRE(session_handle(&session, uptime, &bob, &message, &reply, payload));
    require_error(ERROR_BUSY, 5000);
}

/* Exact to the clock: the session is kept for five seconds after the last message of its peer, of any kind. */
static void test_silence(void)
{
    static const uint8_t chunk[PROTOCOL_CHUNK_SIZE];

    start_udp();
    uptime += SILENCE - 1000 - 1;
    REQUIRE(refused_hello(&bob) == 1);  /* One clock, in milliseconds. */
    REQUIRE(ask(TYPE_STATUS, 1, 0, NULL, 0) == 0x86);
    REQUIRE(refused_hello(&bob) == 5000);
    uptime += HZ;
    REQUIRE(refused_hello(&bob) == 4000);
    /* An old token, an unknown type and a stray chunk count as well. */
    token++;
    ask(TYPE_STATUS, 1, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    token--;
    REQUIRE(refused_hello(&bob) == 5000);
    uptime += HZ;
    ask(0x70, 1, 0, NULL, 0);
    REQUIRE(refused_hello(&bob) == 5000);
    uptime += HZ;
    REQUIRE(!request(TYPE_UPLOAD, 1, 0, chunk, sizeof(chunk)));
    REQUIRE(refused_hello(&bob) == 5000);
    /* Those of other peers do not. */
    uptime += SILENCE - 3000;
    REQUIRE(refused_hello(&bob) == 1);
    make_frame(5, FRAME_LOADING);
    uptime += SILENCE - 1000;
    gateware.log[0] = 0;
    peer = bob;
    hello(1);
    require_log("cfb");
    REQUIRE(counters.value[COUNTER_SESSIONS] == 2 && counters.value[COUNTER_FRAMES_RECLAIMED] == 1);
    REQUIRE(gateware.token == token && peer_is(&gateware.peer, &bob));
}

/* Many times longer than a 32-bit count of clocks lasts. */
static void test_long_silence(void)
{
    for (unsigned minutes = 1; minutes < 100; minutes++) {
        start_udp();
        uptime += (uint64_t)minutes * 60 * HZ;
        peer = bob;
        hello(1);
        REQUIRE(counters.value[COUNTER_SESSIONS] == 2);
    }
}

/* Silent sessions last until another peer's HELLO; its other requests are refused and do not end them. */
static void test_goes_on(void)
{
    uint32_t mine;

    start_udp();
    mine    = token;
    uptime += 10 * SILENCE;
    peer    = bob;
    for (uint8_t type = TYPE_CONFIGURE; type <= TYPE_MISSING; type++) {
        if (type != TYPE_UPLOAD) {
            ask(type, 1, 0, NULL, 0);
            require_error(ERROR_SESSION, 0);
        }
    }
    REQUIRE(counters.value[COUNTER_SESSIONS_REFUSED] == 0);
    peer  = alice;
    token = mine;
    REQUIRE(ask(TYPE_STATUS, 1, 0, NULL, 0) == 0x86);
    REQUIRE(refused_hello(&bob) == 5000);
}

/* A HELLO with the nonce of the session is a repeated HELLO from the same peer only. */
static void test_same_nonce(void)
{
    uint32_t first;

    start_udp();
    first = token;
    hello(1);
    REQUIRE(token == first && counters.value[COUNTER_SESSIONS] == 1);
    require_log("");
    uptime += SILENCE;
    peer    = carol;
    hello(1);
    REQUIRE(token != first && counters.value[COUNTER_SESSIONS] == 2);
}

/* Sends a HELLO as `who`; returns whether it is answered. */
static bool late_hello(const peer_t *who, uint32_t nonce)
{
    uint8_t payload[4];

    peer = *who;
    put_u32(payload, nonce);
    return request(TYPE_HELLO, 0, 0, payload, 4);
}

/* A late copy of the HELLO of any of the last sessions begins no session, and is not answered: from the session's peer,
 * and from others once it has ended. */
static void test_late_hello(void)
{
    for (uint32_t sessions = 2; sessions < 2 * SESSION_HELLOS + 3; sessions++) {
        for (uint32_t age = 1; age < sessions; age++) {
            bool     known = age <= SESSION_HELLOS;
            uint32_t mine;

            start();
            for (uint32_t n = 0; n < sessions; n++) {
                peer = n % 2 == 0 ? alice : carol;
                hello(100 + n);
                REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
            }
            peer = bob;
            hello(1);
            mine = token;
            /* The newest of these, age 1, belongs to the session before bob's. */
            uptime += SILENCE;
            REQUIRE(late_hello((sessions - age) % 2 == 0 ? &alice : &carol, 100 + sessions - age) == !known);
            REQUIRE(counters.value[COUNTER_SESSIONS] == sessions + 1 + !known);
            if (known) {
                peer  = bob;
                token = mine;
                REQUIRE(ask(TYPE_STATUS, 1, 0, NULL, 0) == 0x86);
                /* The nonce of another peer is no copy. */
                peer = carol;
                uptime += SILENCE;
                hello(1);
                REQUIRE(counters.value[COUNTER_SESSIONS] == sessions + 2);
            }
        }
    }
}

/* Two sessions of one peer: the copy of the first one's HELLO does not end the third. */
static void test_late_hello_of_the_same_peer(void)
{
    uint32_t mine;

    start();
    peer = alice;
    hello(1);
    hello(2);
    hello(3);
    mine = token;
    make_frame(5, FRAME_LOADING);
    REQUIRE(!late_hello(&alice, 1) && !late_hello(&alice, 2));
    REQUIRE(counters.value[COUNTER_SESSIONS] == 3 && counters.value[COUNTER_FRAMES_RECLAIMED] == 0);
    token = mine;
    REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.payload[0] == FRAME_LOADING);
    hello(3);
    REQUIRE(token == mine);
}

/* A request of a kind that a stranger can send; every second kind is of the session's address. */
static bool strange_request(unsigned kind)
{
    uint8_t payload[4] = {kind & 0xff, 0x77};
    bool    answered;

    peer   = kind % 2 == 0 ? alice : kind % 4 == 1 ? bob : carol;
    token += kind % 2 == 0;
    if (kind % 6 == 5) {
        answered = request(TYPE_HELLO, 0, 0, payload, 4);
    } else {
        answered = request(kind % 6 == 3 ? 0x70 : TYPE_STATUS, 1, 0, NULL, 0);
    }
    token -= kind % 2 == 0;
    return answered;
}

/* Strangers and wrong tokens get answers at a bounded rate, at any pace; the session gets every answer. */
static void test_strangers(void)
{
    static const uint32_t paces[] = {
        2000, HZ / 10000, HZ / SESSION_STRANGER_RATE - 1, HZ / SESSION_STRANGER_RATE, HZ / SESSION_STRANGER_RATE + 1, HZ,
    };

    for (size_t pace = 0; pace < sizeof(paces) / sizeof(paces[0]); pace++) {
        uint64_t begin;
        uint32_t answered = 0, most;

        start_udp();
        begin = uptime;
        for (unsigned n = 0; n < 3000; n++) {
            uint32_t sent = counters.value[COUNTER_MESSAGES_SENT];
            bool     yes  = strange_request(n);

            answered += yes;
            REQUIRE(counters.value[COUNTER_MESSAGES_SENT] == sent + yes);
            peer = alice;
            REQUIRE(ask(TYPE_STATUS, 1, 0, NULL, 0) == 0x86);
            hello(1);
            uptime += paces[pace] - 2000;
            most = SESSION_STRANGER_BURST + (uint32_t)((uptime - begin) * SESSION_STRANGER_RATE / HZ) + 1;
            REQUIRE(answered <= most);
        }
        REQUIRE(answered + 2 >= most || answered == 3000);
        REQUIRE(counters.value[COUNTER_SESSIONS] == 1);
    }
}

/* A host that begins a session is answered, however many strangers there are. */
static void test_strangers_keep_no_host_out(void)
{
    start_udp();
    for (unsigned n = 0; n < 100; n++) {
        strange_request(n);
    }
    peer = bob;
    uptime += SILENCE;
    for (unsigned n = 0; n < 100; n++) {
        peer = carol;
        request(TYPE_STATUS, 1, 0, NULL, 0);
    }
    peer = bob;
    hello(8);
    REQUIRE(counters.value[COUNTER_SESSIONS] == 2);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a && ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    /* The serial line answers everything. */
    peer = line;
    for (unsigned n = 0; n < 100; n++) {
        ask(TYPE_STATUS, 1, 0, NULL, 0);
        require_error(ERROR_SESSION, 0);
    }
}

static void test_bye(void)
{
    uint32_t mine;

    start_udp();
    mine = token;
    make_frame(5, FRAME_LOADING);
    gateware.log[0] = 0;
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    require_log("cfb");
    REQUIRE(gateware.token == 0 && counters.value[COUNTER_FRAMES_RELEASED] == 1);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    /* Another peer's BYE is not a repeated BYE. */
    peer = bob;
    ask(TYPE_BYE, 0, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    /* And another host may begin a session at once. */
    hello(7);
    REQUIRE(token != mine && gateware.token == token && peer_is(&gateware.peer, &bob));
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    peer = line;
    hello(7);
    REQUIRE(gateware.token == 0);
}

/* Chunks that gateware received keep a session alive. */
static void test_chunks_are_life(void)
{
    start_udp();
    for (int round = 0; round < 4; round++) {
        uptime += SILENCE - 2000;
        gateware.chunks   = round % 2;
        gateware.repeated = 1 - round % 2;
        /* By a HELLO of another peer, which updates the counters, or by the regular updates. */
        if (round >= 2) {
            session_poll(&session, uptime);
        }
        REQUIRE(refused_hello(&bob) == 5000);
    }
    REQUIRE(counters.value[COUNTER_CHUNKS_RECEIVED] == 2 && counters.value[COUNTER_CHUNKS_REPEATED] == 2);
    uptime += SILENCE - 3000;
    REQUIRE(refused_hello(&bob) == 1);
    uptime += SILENCE;
    peer = bob;
    hello(1);
    /* Chunks on the serial line are messages; gateware's counts do not belong to that session. */
    uptime += SILENCE;
    peer = line;
    hello(1);
    uptime += SILENCE - 2000;
    gateware.chunks = 1;
    REQUIRE(refused_hello(&bob) == 1);
}

/* Updates of the counters are rare without requests. */
static void test_poll(void)
{
    start_udp();
    uptime += HZ;
    session_poll(&session, uptime);
    gateware.chunks = 1;
    session_poll(&session, uptime + HZ / 64 - 1);
    REQUIRE(gateware.chunks == 1 && session.heard < uptime);
    session_poll(&session, uptime + HZ / 64);
    REQUIRE(gateware.chunks == 0 && session.heard == uptime + HZ / 64);
}

/* STATISTICS include gateware's counters, for every peer. */
static void test_statistics(void)
{
    start();
    hello(1);
    gateware.chunks = 77;
    REQUIRE(ask(TYPE_STATISTICS, 0, 0, NULL, 0) == 0x89 && reply.length == 4 * COUNTERS);
    REQUIRE(get_u32(reply.payload + 4 * COUNTER_CHUNKS_RECEIVED) == 77);
}

/* Frames over UDP are smaller if gateware counts fewer chunks than a slot holds. */
static void test_size(void)
{
    uint8_t parameters[8] = {PARAMETER_DISPARITIES, 0, 0, 0, 16, 0, 0, 0};

    REQUIRE(transfer.max_pixels < pool.max_pixels);
    start_udp();
    hello(1);
    REQUIRE(get_u32(reply.payload + 24) == 5000);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, parameters, 8) == 0x82);
    open_frame(1, 100, 51);
    require_error(ERROR_SIZE, SIZE_TOO_LARGE);
    require_log("");
    REQUIRE(open_frame(1, 100, 50) == 0x83);
    require_log("o");
    start();
    hello(1);
    REQUIRE(get_u32(reply.payload + 24) == pool.max_pixels);
    REQUIRE(open_frame(1, 100, 51) == 0x83);
    require_log("b");
}

/* A frame is opened in gateware once, is refreshed when a request asks about it, and is closed when it starts. */
static void test_frame(void)
{
    frame_t *frame;

    start_udp();
    frame = make_frame(5, FRAME_LOADING);
    REQUIRE(frame->pitch == 3072 && gateware.frame == frame);
    require_log("o");
    REQUIRE(open_frame(5, 61, 43) == 0x83);
    open_frame(5, 43, 61);
    require_error(ERROR_DUPLICATE, 5);
    require_log("");
    gateware.arrived[0] = 0xfffffff3;  /* All but the third and fourth; the frame has six. */
    REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && get_u32(reply.payload + 12) == 2048);
    require_log("r");
    gateware.arrived[0] = 0xfffffff7;
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 1 && reply.payload[0] == 0x08);
    require_log("r");
    gateware.arrived[0] = 0;
    ask(TYPE_START, 5, 0, NULL, 0);
    require_error(ERROR_INCOMPLETE, 3072);
    require_log("r");
    gateware.arrived[0] = 8;
    gateware.status     = STATUS_TIMEOUT;
    ask(TYPE_START, 5, 0, NULL, 0);
    require_error(ERROR_TIMEOUT, 0);
    require_log("rc");
    REQUIRE(frame->state == FRAME_LOADING);
    gateware.status = STATUS_OK;
    REQUIRE(ask(TYPE_START, 5, 0, NULL, 0) == 0x85 && frame->state == FRAME_READY);
    require_log("rc");
    REQUIRE(ask(TYPE_START, 5, 0, NULL, 0) == 0x85);
    REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.payload[0] == FRAME_READY);
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 1 && reply.payload[0] == 0);
    require_log("");
}

/* Gateware that is not ready costs the frame, not the slot. */
static void test_open_fails(void)
{
    start_udp();
    gateware.status = STATUS_TIMEOUT;
    for (int round = 0; round < 2 * SLOTS; round++) {
        open_frame(5, 72, 50);
        require_error(ERROR_TIMEOUT, 0);
    }
    REQUIRE(counters.value[COUNTER_FRAMES_OPENED] == 0);
    gateware.status = STATUS_OK;
    REQUIRE(open_frame(5, 72, 50) == 0x83 && get_u16(reply.payload) == 0);
}

/* The memory of a freed slot is not in use, in any state before. */
static void test_release(void)
{
    for (frame_state_t state = FRAME_LOADING; state <= FRAME_FAILED; state++) {
        start_udp();
        gateware.arrived[0] = 0x3f;
        make_frame(5, state);
        gateware.log[0] = 0;
        gateware.status = STATUS_TIMEOUT;  /* Even then the slot is freed. */
        REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88);
        require_log(state == FRAME_LOADING ? "cf" : "f");
        REQUIRE(pool.frame[0].state == FRAME_EMPTY && stops == (state == FRAME_MATCHING));
        REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88);
        require_log("");
    }
}

static void read_map(uint32_t offset, uint32_t length, bool answered)
{
    uint8_t payload[4];

    put_u32(payload, length);
    REQUIRE(request(TYPE_READ, 5, offset, payload, 4) == answered);
}

static void test_read(void)
{
    uint32_t size = 2 * 61 * 43;
    uint32_t sent;

    start_udp();
    gateware.arrived[0] = 0x3f;
    make_frame(5, FRAME_DONE);
    gateware.log[0] = 0;
    sent = counters.value[COUNTER_MESSAGES_SENT];
    for (uint32_t offset = 0; offset < size + 2048; offset += 512) {
        static const uint32_t lengths[] = {0, 1, 1024, 1025, 5245, 5246, 5247, 0xffffffff};

        for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
            bool in_map = offset < size && lengths[i] <= size - offset;
            bool good   = lengths[i] > 0 && in_map && offset % 1024 == 0;

            read_map(offset, lengths[i], !good);
            if (good) {
                require_log("R");
                REQUIRE(gateware.length == lengths[i] && gateware.frame == &pool.frame[0]);
            } else if (lengths[i] == 0) {
                require_error(ERROR_LENGTH, 1024);
            } else {
                require_error(ERROR_OFFSET, offset);
            }
        }
    }
    REQUIRE(counters.value[COUNTER_MESSAGES_SENT] - sent == counters.value[COUNTER_REQUESTS_REFUSED]);
    require_log("");
    gateware.full = true;
    read_map(0, size, true);
    require_error(ERROR_BUSY, 8);
    REQUIRE(counters.value[COUNTER_SESSIONS_REFUSED] == 0);
}

/* An UPLOAD that reaches the firmware over UDP is dropped; one of another version is answered as such. */
static void test_stray_upload(void)
{
    static const uint8_t chunk[PROTOCOL_CHUNK_SIZE];
    message_t message = {.version = 2, .type = TYPE_UPLOAD};
    uint8_t   payload[PROTOCOL_CHUNK_SIZE];
    frame_t  *frame;

    start_udp();
    frame = make_frame(5, FRAME_LOADING);
    save_memory();
    REQUIRE(!request(TYPE_UPLOAD, 5, 0, chunk, sizeof(chunk)));
    peer = bob;
    REQUIRE(!request(TYPE_UPLOAD, 5, 0, chunk, sizeof(chunk)));
    REQUIRE(frame->missing == 6 && counters.value[COUNTER_CHUNKS_RECEIVED] == 0);
    require_untouched();
    REQUIRE(session_handle(&session, uptime, &alice, &message, &reply, payload));
    require_error(ERROR_VERSION, 1);
}

/* MISSING on the serial line, of frames whose chunks fill the last word in part. */
static void test_missing(void)
{
    uint8_t chunk[PROTOCOL_CHUNK_SIZE] = {0};

    start();
    hello(1);
    ask(TYPE_MISSING, 5, 0, NULL, 0);
    require_error(ERROR_FRAME, 5);
    REQUIRE(open_frame(5, 100, 50) == 0x83);
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 2);
    REQUIRE(reply.payload[0] == 0xff && reply.payload[1] == 0x03);
    REQUIRE(ask(TYPE_UPLOAD, 5, 1024, chunk, 1024) == 0x84);
    REQUIRE(ask(TYPE_UPLOAD, 5, 9216, chunk, 904) == 0x84);
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 2);
    REQUIRE(reply.payload[0] == 0xfd && reply.payload[1] == 0x01);
    require_log("b");
    /* Eight chunks: whole bytes, and none after them. */
    REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88);
    REQUIRE(open_frame(5, 100, 40) == 0x83);
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 1 && reply.payload[0] == 0xff);
    /* 36 chunks: the second word, and no byte after the last. */
    REQUIRE(ask(TYPE_RELEASE, 5, 0, NULL, 0) == 0x88);
    REQUIRE(open_frame(5, 180, 100) == 0x83);
    REQUIRE(ask(TYPE_UPLOAD, 5, 33 * 1024, chunk, 1024) == 0x84);
    REQUIRE(ask(TYPE_UPLOAD, 5, 8 * 1024, chunk, 1024) == 0x84);
    REQUIRE(ask(TYPE_MISSING, 5, 0, NULL, 0) == 0x8b && reply.length == 5);
    REQUIRE(memcmp(reply.payload, "\xff\xfe\xff\xff\x0d", 5) == 0);
}

/* Without UDP there are no calls. */
static void test_no_transfer(void)
{
    set_up();
    hello(1);
    make_frame(5, FRAME_LOADING);
    session_poll(&session, uptime + HZ);
    REQUIRE(ask(TYPE_STATISTICS, 0, 0, NULL, 0) == 0x89);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    /* Nor is there a path for streamed frames, for any peer. */
    peer = alice;
    hello(2);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_STREAMING) == 0);
    ask(TYPE_STREAM, 1, 0, "\75\0\53\0", 4);
    require_error(ERROR_TYPE, TYPE_STREAM);
}

/* Every message changes what the next token will be, and none leads to a token of 0. */
static void test_tokens(void)
{
    static const uint8_t nonce[4] = {0};
    message_t            message  = {.version = 1, .type = TYPE_STATUS};
    message_t            greeting = {.version = 1, .type = TYPE_HELLO, .length = 4, .payload = nonce};
    uint8_t              payload[PROTOCOL_CHUNK_SIZE];
    uint32_t             tokens[4];

    for (uint32_t round = 0; round < 4; round++) {
        set_up();
        if (round > 0) {
            session_handle(&session, round, &line, &message, &reply, payload);
        }
        session_handle(&session, 1000, &line, &greeting, &reply, payload);
        tokens[round] = session.token;
        for (uint32_t before = 0; before < round; before++) {
            REQUIRE(tokens[before] != tokens[round]);
        }
    }
    for (uint32_t state = 1; state < 10000; state++) {
        set_up();
        session.random = state;
        session_handle(&session, state, &line, &greeting, &reply, payload);
        REQUIRE(session.token != 0 && session.random != 0);
    }
}

int main(void)
{
    test_busy();
    test_order_of_judgement();
    test_silence();
    test_long_silence();
    test_goes_on();
    test_same_nonce();
    test_late_hello();
    test_late_hello_of_the_same_peer();
    test_strangers();
    test_strangers_keep_no_host_out();
    test_bye();
    test_chunks_are_life();
    test_poll();
    test_statistics();
    test_size();
    test_frame();
    test_open_fails();
    test_release();
    test_read();
    test_stray_upload();
    test_missing();
    test_no_transfer();
    test_tokens();
    return 0;
}
