/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Feeds datagrams through mailbox, link, session and frame pool:
 *
 *   fuzz_udp [seed] [count]
 *
 * Around every slot and the mailbox is memory that must not be touched. Every image of a frame that has started, all
 * pairs of a streamed frame, and every part of a map that is sent are compared with the expected bytes. */

#define _DEFAULT_SOURCE

#include <sanitizer/asan_interface.h>
#include <string.h>
#include <time.h>

#include "fake_flash.h"
#include "fake_frame_link.h"
#include "fake_stream.h"
#include "fuzz_datagrams.h"
#include "generated/soc.h"
#include "lib/bytes.h"
#include "link/udp/udp_link.h"
#include "litestereo/platform.h"
#include "require.h"

#define HZ        1000000u
#define GAP       4096u
#define CANARY    0xa5
#define SLOT_SIZE 16384u
#define MAP_MAX   (SLOT_SIZE / 2)

/* Gap, mailbox, gap, slot, gap, slot, ... gap. */
static _Alignas(FRAME_ALIGNMENT) uint8_t
    memory[GAP + FRAME_LINK_MAILBOX_SIZE + GAP + FRAME_POOL_SLOTS * (SLOT_SIZE + GAP)];

static _Alignas(FRAME_ALIGNMENT) uint8_t reply_payload[PROTOCOL_CHUNK_SIZE];

static frame_pool_t  pool;
static counters_t    counters;
static session_t     session;
static frame_link_t  driver;
static udp_link_t    udp;
static flash_t       flash;
static records_t     records;
static trial_t       trial;
static update_t      update;
static uint64_t      ticks;
static unsigned      seed;
static device_info_t info = {
    .max_width = 640, .max_height = 480, .sys_clk_hz = HZ, .name = "fuzz",
    .limits = {.max_disparities = 64, .min_block_size = 5, .max_block_size = 21, .features = 0xff},
};

static _Alignas(8) uint8_t image[FLASH_IMAGE_BYTES];

/* The frame in each slot. */
static struct {
    bool    checked;       /**< Its images have been compared since it started. */
    uint8_t map[MAP_MAX];  /**< Its map, once it is DONE. */
} known[FRAME_POOL_SLOTS];

static uint32_t parts;                     /* Parts of maps that were sent. */
static uint32_t live;                      /* Those of them that were sent without a READ. */
static uint32_t images;                    /* Chunks of a firmware that were stored. */
static uint32_t streamed;                  /* Streamed frames that were matched. */
static uint32_t errors[ERROR_BUSY + 1];    /* Refusals by code. */

void reset_forget_starts(void)
{
}

uint64_t clock_now(void)
{
    ticks += HZ / 1000;
    fake_frame_link_advance();
    return ticks;
}

void memory_to_device(void)   {}
void memory_from_device(void) {}

static uint8_t *mailbox(void)
{
    return memory + GAP;
}

static uint8_t *gap(unsigned number)
{
    return number == 0 ? memory : mailbox() + FRAME_LINK_MAILBOX_SIZE + (number - 1) * (SLOT_SIZE + GAP);
}

/* The gaps are poisoned for instrumented accesses, and filled so that other writes show. */
static void close_gaps(void)
{
    for (unsigned number = 0; number < FRAME_POOL_SLOTS + 2; number++) {
        memset(gap(number), CANARY, GAP);
        ASAN_POISON_MEMORY_REGION(gap(number), GAP);
    }
}

static void check_gaps(void)
{
    for (unsigned number = 0; number < FRAME_POOL_SLOTS + 2; number++) {
        ASAN_UNPOISON_MEMORY_REGION(gap(number), GAP);
        for (unsigned i = 0; i < GAP; i++) {
            REQUIRE(gap(number)[i] == CANARY);
        }
    }
    close_gaps();
}

/* Requires that the images are those that were sent. */
static void check_images(const frame_t *frame)
{
    for (uint32_t chunk = 0; chunk < frame_chunks(frame); chunk++) {
        uint32_t offset = chunk * PROTOCOL_CHUNK_SIZE;

        REQUIRE(memcmp(frame->memory + offset, fuzz_chunk(frame->id, offset), frame_chunk_length(frame, offset)) == 0);
    }
}

static void check_frames(bool again)
{
    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        const frame_t *frame = &pool.frame[slot];

        if (frame->state <= FRAME_LOADING) {
            known[slot].checked = false;
        } else if (!frame->streamed && (again || !known[slot].checked)) {
            check_images(frame);
            known[slot].checked = true;
        }
    }
}

static bool take_reply(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    message_t message;

    REQUIRE(peer->udp && message_parse(bytes, length, &message) == STATUS_OK);
    REQUIRE((message.type & PROTOCOL_REPLY_BIT) != 0);
    if (message.type == TYPE_ERROR) {
        REQUIRE(message.length == PROTOCOL_ERROR_SIZE && get_u16(message.payload) <= ERROR_BUSY);
        errors[get_u16(message.payload)]++;
    } else if (message.type == (TYPE_IMAGE | PROTOCOL_REPLY_BIT)) {
        images++;
    } else if (message.type == (TYPE_READ | PROTOCOL_REPLY_BIT)) {
        const frame_t *frame = frame_pool_find(&pool, FRAME_OWNER_LINK, message.frame_id);

        REQUIRE(frame != NULL && frame->state == FRAME_DONE && peer_is(peer, &session.peer));
        REQUIRE(message.session == session.token && message.offset + message.length <= frame_map_size(frame));
        REQUIRE(memcmp(message.payload, known[frame->slot].map + message.offset, message.length) == 0);
        parts++;
        live += frame->streamed && message.sequence == frame->sequence;
    }
    return true;
}

/* The matcher, slow and irregular. */

static void fail(frame_t *frame, enum protocol_error error)
{
    if (frame->streamed) {
        (void)udp.stream.close(udp.stream.context);
    }
    frame_finish(frame, &(frame_result_t){.error = (uint16_t)error});
}

static void stop(void *context, frame_t *frame)
{
    (void)context;
    fail(frame, ERROR_MATCHER);
}

static void begin(void)
{
    frame_t *frame = frame_pool_next(&pool);

    if (frame != NULL && (!frame->streamed || udp.stream.open(udp.stream.context, frame) == STATUS_OK)) {
        REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    }
}

/* Requires that the pairs are those that were sent, in order. */
static void check_pairs(const frame_t *frame)
{
    const uint8_t *pairs = fake_stream_pairs();

    for (uint32_t offset = 0; offset < frame_map_size(frame); offset += PROTOCOL_CHUNK_SIZE) {
        uint32_t rest = frame_map_size(frame) - offset;

        REQUIRE(memcmp(pairs + offset, fuzz_chunk(frame->id, offset),
            rest < PROTOCOL_CHUNK_SIZE ? rest : PROTOCOL_CHUNK_SIZE) == 0);
    }
}

static void match(void)
{
    frame_t *frame = frame_pool_matching(&pool);

    if (frame == NULL) {
        begin();
    } else if (next_random(&seed) % (frame->streamed ? 256 : 16) == 0) {
        fail(frame, next_random(&seed) % 2 ? ERROR_TIMEOUT : ERROR_MATCHER);
        counters.value[COUNTER_FRAMES_FAILED]++;
    } else if (!frame->streamed || fake_stream_pairs() != NULL) {
        memcpy(known[frame->slot].map, fuzz_chunk(next_random(&seed) % 4096, 0), PROTOCOL_CHUNK_SIZE);
        for (uint32_t at = PROTOCOL_CHUNK_SIZE; at < frame_map_size(frame); at += PROTOCOL_CHUNK_SIZE) {
            memcpy(known[frame->slot].map + at, fuzz_chunk(next_random(&seed) % 4096, at), PROTOCOL_CHUNK_SIZE);
        }
        memcpy(frame_map(frame), known[frame->slot].map, frame_map_size(frame));
        if (frame->streamed) {
            check_pairs(frame);
            fake_stream_map(known[frame->slot].map, frame_map_size(frame));
            streamed++;
        }
        frame_finish(frame, &(frame_result_t){.clocks = 1});
        counters.value[COUNTER_FRAMES_MATCHED]++;
    }
}

static bool is_matching(void)
{
    return frame_pool_matching(&pool) != NULL;
}

/* A host at the serial line sends requests, too. */
static void ask_on_the_line(void)
{
    static const peer_t line;
    uint8_t   nonce[4] = {0}, payload[PROTOCOL_CHUNK_SIZE];
    message_t request  = {.version = 1, .type = TYPE_HELLO, .length = 4, .payload = nonce};
    message_t reply;

    if (!session.peer.udp && session.open) {
        request = (message_t){.version = 1, .type = TYPE_BYE, .session = session.token, .payload = nonce};
    }
    session_handle(&session, ticks, &line, &request, &reply, payload);
}

static void step(void)
{
    clock_now();
    udp_link_poll(&udp, ticks);
    session_poll(&session, ticks);
    trial_poll(&trial, ticks);
    update_poll(&update, ticks);
    /* The device restarts at once, with its memory unchanged. */
    session.restarting = session.restarting && !session_wants_restart(&session, ticks);
    check_frames(false);
}

static void start(void)
{
    REQUIRE(frame_pool_init(&pool, memory, FRAME_POOL_SLOTS * SLOT_SIZE, FRAME_POOL_SLOTS) == STATUS_OK);
    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        pool.frame[slot].memory = gap(slot + 1) + GAP;
    }
    REQUIRE(pool.max_pixels <= MAP_MAX / 2);
    close_gaps();
    session_init(&session, &info, &pool, &counters, stop, NULL);
    fake_flash_reset();
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    REQUIRE(records_init(&records, &flash) == STATUS_OK);
    trial_init(&trial, &records, &(reset_report_t){.image = 1}, HZ);
    update_init(&update, &flash, &trial, image);
    session.update = &update;
    fake_frame_link.version   = FRAME_LINK_VERSION;
    fake_frame_link.streaming = true;
    fake_frame_link.skips     = 8;
    fake_frame_link.send      = take_reply;
    fake_frame_link.matching  = is_matching;
    REQUIRE(frame_link_init(&driver, mailbox()) == STATUS_OK);
    REQUIRE(udp_link_init(&udp, &driver, &session, &counters, reply_payload) == STATUS_OK);
    fuzz_prepare(&seed);
}

static void fuzz(unsigned long count)
{
    static fuzz_datagram_t datagram;
    unsigned               asleep = 0, hanging = 0;  /* Datagrams during which firmware or gateware does nothing. */

    for (unsigned long number = 0; number < count; number++) {
        asleep  = asleep > 0 ? asleep - 1 : next_random(&seed) % 512 == 0 ? next_random(&seed) % 64 : 0;
        hanging = hanging > 0 ? hanging - 1 : next_random(&seed) % 2048 == 0 ? next_random(&seed) % 16 : 0;
        fake_frame_link.hang = hanging > 0;
        fuzz_datagram(&seed, &session, &datagram);
        fake_frame_link_receive(&datagram.peer, datagram.bytes, datagram.length);
        if (asleep == 0) {
            step();
        }
        if (next_random(&seed) % 2 == 0) {
            match();
        }
        if (next_random(&seed) % 256 == 0) {
            ask_on_the_line();
        }
        ticks += next_random(&seed) % 1024 == 0 ? 6 * HZ : 0;
        if (number % 256 == 0) {
            check_frames(true);
        }
        if (number % 65536 == 0) {
            check_gaps();
        }
    }
    check_gaps();
}

/* The test is complete: every counter that datagrams can reach has changed, and every refusal occurred. */
static void require_depth(void)
{
    static const uint8_t not_here[] = {
        COUNTER_BYTES_RECEIVED, COUNTER_FRAMING_ERRORS, COUNTER_CRC_ERRORS, COUNTER_RECEIVE_TIMEOUTS,
        COUNTER_MATCHER_INTERRUPTS, COUNTER_MATCHER_TIMEOUTS, COUNTER_CONSOLE_LINES, COUNTER_DATAGRAMS_OVERRUN,
    };

    session_update_counters(&session, ticks);
    for (uint8_t counter = 0; counter < COUNTERS; counter++) {
        if (counters.value[counter] == 0 && memchr(not_here, counter, sizeof(not_here)) == NULL) {
            fprintf(stderr, "%s has not moved\n", counter_name(counter));
            exit(1);
        }
    }
    for (unsigned code = ERROR_NONE + 1; code <= ERROR_BUSY; code++) {
        if (errors[code] == 0 && code != ERROR_FEATURE) {
            fprintf(stderr, "error %u was not met\n", code);
            exit(1);
        }
    }
    /* Firmwares were uploaded, and none of them was valid. */
    REQUIRE(images > 0 && fake_flash.operations == 0);
    REQUIRE(parts > live && live > 0 && streamed > 0);
}

/* And the device still answers a new host. */
static void require_life(void)
{
    static const peer_t peer = {.udp = true, .address = 0x0a000001, .port = 1};
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX], nonce[4] = {77};
    message_t message  = {.version = 1, .type = TYPE_HELLO, .length = 4, .payload = nonce};
    uint32_t  sessions = counters.value[COUNTER_SESSIONS];

    fake_frame_link.hang = false;
    for (int i = 0; i < 100; i++) {
        step();
    }
    ticks += 6 * HZ;
    fake_frame_link_receive(&peer, bytes, message_build(&message, bytes));
    step();
    REQUIRE(counters.value[COUNTER_SESSIONS] == sessions + 1 && peer_is(&session.peer, &peer));
    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        REQUIRE(pool.frame[slot].state == FRAME_EMPTY);
    }
}

int main(int argc, char **argv)
{
    unsigned long   count = argc > 2 ? strtoul(argv[2], NULL, 0) : 200000;
    struct timespec begin, end;
    double          seconds;

    seed  = argc > 1 ? (unsigned)strtoul(argv[1], NULL, 0) : 1;
    seed += seed == 0;
    start();
    clock_gettime(CLOCK_MONOTONIC, &begin);
    fuzz(count);
    clock_gettime(CLOCK_MONOTONIC, &end);
    require_depth();
    require_life();
    seconds = (double)(end.tv_sec - begin.tv_sec) + (double)(end.tv_nsec - begin.tv_nsec) / 1e9;
    printf("%lu datagrams, %.0f/s; %u frames matched, %u of them streamed, %u parts of maps, %u sessions\n", count,
        (double)count / seconds, (unsigned)counters.value[COUNTER_FRAMES_MATCHED], (unsigned)streamed, (unsigned)parts,
        (unsigned)counters.value[COUNTER_SESSIONS]);
    return 0;
}
