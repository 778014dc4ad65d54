/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "session_bench.h"

#include <sanitizer/asan_interface.h>
#include <string.h>

#include "fake_frame_link.h"
#include "fake_stream.h"
#include "lib/bytes.h"
#include "litestereo/platform.h"
#include "litestereo/reset.h"

#define GAP       256u
#define SLOT_SIZE 16384u

/* Gap, mailbox, gap, slot, gap, slot, ... gap. */
static _Alignas(FRAME_ALIGNMENT) uint8_t
    memory[GAP + FRAME_LINK_MAILBOX_SIZE + GAP + FRAME_POOL_SLOTS * (SLOT_SIZE + GAP)];

static _Alignas(FRAME_ALIGNMENT) uint8_t reply_payload[PROTOCOL_CHUNK_SIZE];

static frame_link_t  driver;
static device_info_t info = {
    .max_width = 200, .max_height = 50, .sys_clk_hz = HZ, .name = "fuzz",
    .limits = {.max_disparities = 64, .min_block_size = 5, .max_block_size = 21, .features = 0x4ff},
};

static const stereo_t  stereo = {.capabilities = {.max_width = 200, .limits = {.features = 0x4ff}}};
static rectification_t rectification;
static calibrate_t     calibrate;
static uint8_t         calibrations[CALIBRATE_MEMORY_BYTES];

session_t     session;
frame_pool_t  pool;
counters_t    counters;
serial_link_t line;
udp_link_t    udp;
uint64_t      ticks;
unsigned      replies;
message_t     reply;

uint64_t clock_now(void)
{
    ticks += HZ / 1000;
    fake_frame_link_advance();
    return ticks;
}

void memory_to_device(void)   {}
void memory_from_device(void) {}
void reset_forget_starts(void) {}

static uint8_t *gap(unsigned number)
{
    return number == 0 ? memory : memory + GAP + FRAME_LINK_MAILBOX_SIZE + (number - 1) * (SLOT_SIZE + GAP);
}

static void check_reply(const message_t *message)
{
    HOLDS(message->version == PROTOCOL_VERSION && (message->type & PROTOCOL_REPLY_BIT) != 0);
    HOLDS(message->type != TYPE_ERROR
        || (message->length == PROTOCOL_ERROR_SIZE && get_u16(message->payload) - 1u < ERROR_FLASH));
}

/* The serial line carries one framed reply at a time. */
static void write_line(void *context, const uint8_t *bytes, size_t length)
{
    static uint8_t plain[PROTOCOL_MESSAGE_MAX];
    cobs_decoder_t decoder;

    (void)context;
    cobs_decoder_init(&decoder, plain, sizeof(plain));
    HOLDS(length > 2 && bytes[0] == 0 && bytes[length - 1] == 0);
    HOLDS(cobs_decode(&decoder, bytes + 1, length - 1) == length - 2 && cobs_decoder_finish(&decoder) == STATUS_OK);
    HOLDS(message_parse(plain, decoder.length, &reply) == STATUS_OK);
    check_reply(&reply);
    replies++;
}

static void take_text(void *context, const uint8_t *bytes, size_t length)
{
    (void)context;
    HOLDS(length > 0 && memchr(bytes, 0, length) == NULL);
}

/* Parts of a map are of a frame that is DONE, and go to its owner. */
static bool take_datagram(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    message_t message;

    HOLDS(peer->udp && message_parse(bytes, length, &message) == STATUS_OK);
    check_reply(&message);
    if (message.type == (TYPE_READ | PROTOCOL_REPLY_BIT)) {
        const frame_t *frame = frame_pool_find(&pool, FRAME_OWNER_LINK, message.frame_id);

        HOLDS(frame != NULL && frame->state == FRAME_DONE && peer_is(peer, &session.peer));
        HOLDS(message.session == session.token && frame_has(frame, message.offset, message.length));
        HOLDS(memcmp(message.payload, frame_map(frame) + message.offset, message.length) == 0);
    }
    return true;
}

static void end(frame_t *frame, enum protocol_error error)
{
    if (frame->streamed && error != ERROR_NONE) {
        (void)udp.stream.close(udp.stream.context);
    }
    HOLDS(frame_finish(frame, &(frame_result_t){.error = (uint16_t)error}) == STATUS_OK);
}

static void stop(void *context, frame_t *frame)
{
    (void)context;
    end(frame, ERROR_MATCHER);
}

static bool is_matching(void)
{
    return frame_pool_matching(&pool) != NULL;
}

void bench_match(bool well)
{
    frame_t *frame = frame_pool_matching(&pool);

    if (frame == NULL) {
        frame = frame_pool_next(&pool);
        if (frame != NULL && (!frame->streamed || udp.stream.open(udp.stream.context, frame) == STATUS_OK)) {
            HOLDS(frame_pool_begin(&pool, frame) == STATUS_OK);
        }
    } else if (!well) {
        end(frame, ERROR_TIMEOUT);
    } else if (!frame->streamed || fake_stream_pairs() != NULL) {
        memset(frame_map(frame), (int)(ticks / 1000), frame_map_size(frame));
        if (frame->streamed) {
            fake_stream_map(frame_map(frame), frame_map_size(frame));
        }
        end(frame, ERROR_NONE);
#ifdef PLANTED_FAULT
        frame->memory[SLOT_SIZE] = 0;
#endif
    }
}

static void make_links(void)
{
    serial_link_init(&line, &session, &counters, HZ);
    line.write   = write_line;
    line.console = take_text;
    fake_frame_link_reset();
    fake_frame_link.version   = FRAME_LINK_VERSION;
    fake_frame_link.streaming = true;
    fake_frame_link.skips     = 8;
    fake_frame_link.send      = take_datagram;
    fake_frame_link.matching  = is_matching;
    HOLDS(frame_link_init(&driver, memory + GAP) == STATUS_OK);
    HOLDS(udp_link_init(&udp, &driver, &session, &counters, reply_payload) == STATUS_OK);
}

void bench_reset(void)
{
    ticks = 0;
    memset(&counters, 0, sizeof(counters));
    HOLDS(frame_pool_init(&pool, memory, FRAME_POOL_SLOTS * SLOT_SIZE, FRAME_POOL_SLOTS) == STATUS_OK);
    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        pool.frame[slot].memory = gap(slot + 1) + GAP;
    }
    for (unsigned number = 0; number < FRAME_POOL_SLOTS + 2; number++) {
        ASAN_POISON_MEMORY_REGION(gap(number), GAP);
    }
    session_init(&session, &info, &pool, &counters, stop, NULL);
    HOLDS(rectification_init(&rectification, &stereo) == STATUS_OK);
    calibrate_init(&calibrate, &rectification, NULL, calibrations);
    session.calibrate = &calibrate;
    make_links();
}

void bench_poll(void)
{
    clock_now();
    serial_link_poll(&line, ticks);
    udp_link_poll(&udp, ticks);
    session_poll(&session, ticks);
    calibrate_poll(&calibrate, ticks);
    /* The device restarts at once, with its memory unchanged. */
    session.restarting = session.restarting && !session_wants_restart(&session, ticks);
}

void bench_check(void)
{
    unsigned matching = 0;

    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        const frame_t *frame = &pool.frame[slot];

        HOLDS((frame->state == FRAME_EMPTY) == (frame->owner == FRAME_OWNER_NONE));
        HOLDS(frame->state == FRAME_EMPTY || frame_pool_find(&pool, frame->owner, frame->id) == frame);
        HOLDS(frame->state < FRAME_READY || frame->missing == 0);
        /* Without a session there are no frames of the link. */
        HOLDS(frame->state == FRAME_EMPTY || session.open);
        matching += frame->state == FRAME_MATCHING;
    }
    HOLDS(rectification.calibration.width == 0 || rectification.calibration.size <= CALIBRATE_ROOM);
    HOLDS(matching <= 1 && udp.queued <= PROTOCOL_QUEUED_READS && (!session.open || session.token != 0));
}
