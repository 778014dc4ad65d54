/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fixture.h"

#include <string.h>

#include "litestereo/platform.h"
#include "litestereo/reset.h"
#include "require.h"

#define MEMORY_SIZE (1 << 18)

static uint8_t memory[4096 + MEMORY_SIZE + 4096], seen[sizeof(memory)];
static uint8_t payload_of_reply[PROTOCOL_CHUNK_SIZE];
static uint32_t sequence;

session_t     session;
frame_pool_t  pool;
counters_t    counters;
unsigned      stops;
uint32_t      token;
message_t     reply;
peer_t        peer;
uint64_t      uptime;
device_info_t device_info = {
    .gateware_version = 0x0203, .firmware_version = 0x0405, .max_width = 640, .max_height = 480,
    .limits = {.max_disparities = 64, .min_block_size = 5, .max_block_size = 21, .features = 0x112233ff},
    .sys_clk_hz = 60000000, .name = "test",
};

void reset_forget_starts(void)
{
}

/* Some tests define another clock. */
__attribute__((weak)) uint64_t clock_now(void)
{
    return uptime;
}

static void stop(void *context, frame_t *frame)
{
    REQUIRE(context == &stops && frame->state == FRAME_MATCHING);
    frame_finish(frame, &(frame_result_t){.error = ERROR_MATCHER, .detail = 3});
    stops++;
}

void set_up(void)
{
    memset(memory, CANARY, sizeof(memory));
    save_memory();
    memset(&counters, 0, sizeof(counters));
    stops  = 0;
    token  = 0;
    peer   = (peer_t){0};
    uptime = 0;
    REQUIRE(frame_pool_init(&pool, memory + 4096, MEMORY_SIZE, SLOTS) == STATUS_OK);
    session_init(&session, &device_info, &pool, &counters, stop, &stops);
}

bool request(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length)
{
    message_t message = {
        .version = PROTOCOL_VERSION, .type = type, .session = token, .sequence = ++sequence, .frame_id = frame_id,
        .offset = offset, .length = length, .payload = payload,
    };
    uint32_t received = counters.value[COUNTER_MESSAGES_RECEIVED];
    bool     answered;

    uptime  += 1000;
    answered = session_handle(&session, uptime, &peer, &message, &reply, payload_of_reply);
    REQUIRE(counters.value[COUNTER_MESSAGES_RECEIVED] == received + 1);
    return answered;
}

uint8_t ask(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length)
{
    REQUIRE(request(type, frame_id, offset, payload, length));
    REQUIRE(reply.version == PROTOCOL_VERSION && reply.session == token && reply.sequence == sequence);
    REQUIRE(reply.frame_id == frame_id && reply.offset == offset && reply.length <= PROTOCOL_CHUNK_SIZE);
    REQUIRE(reply.type == (type | PROTOCOL_REPLY_BIT) || (reply.type == TYPE_ERROR && reply.payload[2] == type));
    return reply.type;
}

void hello(uint32_t nonce)
{
    uint8_t payload[4];

    token = 0;
    put_u32(payload, nonce);
    REQUIRE(ask(TYPE_HELLO, 0, 0, payload, 4) == (TYPE_HELLO | PROTOCOL_REPLY_BIT));
    REQUIRE(reply.length >= PROTOCOL_CAPABILITIES_SIZE);
    REQUIRE((reply.length - PROTOCOL_CAPABILITIES_SIZE) % PROTOCOL_CAPABILITY_SIZE == 0);
    token = get_u32(reply.payload);
}

uint8_t open_frame(uint32_t frame_id, uint16_t width, uint16_t height)
{
    uint8_t payload[4];

    put_u16(payload, width);
    put_u16(payload + 2, height);
    return ask(TYPE_OPEN, frame_id, 0, payload, 4);
}

frame_t *make_frame(uint32_t frame_id, frame_state_t state)
{
    uint8_t  parameters[16] = {PARAMETER_DISPARITIES, 0, 0, 0, 16, 0, 0, 0, PARAMETER_BLOCK_SIZE, 0, 0, 0, 5, 0, 0, 0};
    frame_t *frame;

    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, parameters, sizeof(parameters)) == 0x82);
    REQUIRE(open_frame(frame_id, 61, 43) == 0x83);
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, frame_id);
    REQUIRE(frame != NULL);
    if (state >= FRAME_READY) {
        frame_fill(frame);
        REQUIRE(ask(TYPE_START, frame_id, 0, NULL, 0) == 0x85);
    }
    if (state >= FRAME_MATCHING) {
        REQUIRE(frame_pool_begin(&pool, frame) == STATUS_OK);
    }
    if (state == FRAME_DONE) {
        frame_finish(frame, &(frame_result_t){.clocks = 777, .first_row_clocks = 33});
    } else if (state == FRAME_FAILED) {
        frame_finish(frame, &(frame_result_t){.error = ERROR_MATCHER, .detail = 2});
    }
    REQUIRE(frame->state == state);
    return frame;
}

void require_error(enum protocol_error code, uint32_t detail)
{
    if (reply.type != TYPE_ERROR || get_u16(reply.payload) != code || get_u32(reply.payload + 4) != detail) {
        fprintf(stderr, "type 0x%x, code %u, detail %u\n", reply.type, get_u16(reply.payload),
            (unsigned)get_u32(reply.payload + 4));
    }
    REQUIRE(reply.type == TYPE_ERROR && reply.length == PROTOCOL_ERROR_SIZE && reply.payload[3] == 0);
    REQUIRE(get_u16(reply.payload) == code && get_u32(reply.payload + 4) == detail);
}

void save_memory(void)
{
    memcpy(seen, memory, sizeof(memory));
}

void require_untouched(void)
{
    REQUIRE(memcmp(seen, memory, sizeof(memory)) == 0);
}
