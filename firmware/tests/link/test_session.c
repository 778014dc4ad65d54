/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about the session as a whole. */

#include <string.h>

#include "fixture.h"
#include "require.h"

static void put_parameter(uint8_t *entry, uint16_t parameter, int32_t value)
{
    put_u16(entry, parameter);
    put_u16(entry + 2, 0);
    put_u32(entry + 4, (uint32_t)value);
}

static void test_hello(void)
{
    set_up();
    hello(0xcafe);
    REQUIRE(token != 0 && get_u32(reply.payload + 4) == 0xcafe);
    REQUIRE(get_u16(reply.payload + 8) == 0x0203 && get_u16(reply.payload + 10) == 0x0405);
    REQUIRE(get_u16(reply.payload + 12) == 640 && get_u16(reply.payload + 14) == 480);
    REQUIRE(get_u16(reply.payload + 16) == 64 && reply.payload[18] == 5 && reply.payload[19] == 21);
    REQUIRE(get_u32(reply.payload + 20) == 0x112230ff && get_u32(reply.payload + 24) == pool.max_pixels);
    REQUIRE(get_u16(reply.payload + 28) == SLOTS && get_u16(reply.payload + 30) == 1024);
    REQUIRE(get_u32(reply.payload + 32) == 60000000);
    REQUIRE(memcmp(reply.payload + 36, "test\0\0\0\0\0\0\0\0\0\0\0\0", 16) == 0);
    REQUIRE(counters.value[COUNTER_SESSIONS] == 1);
}

static void test_hello_again(void)
{
    uint32_t first;

    set_up();
    hello(5);
    first = token;
    hello(5);
    REQUIRE(token == first && counters.value[COUNTER_SESSIONS] == 1);
    hello(6);
    REQUIRE(token != first && counters.value[COUNTER_SESSIONS] == 2);
    first = token;
    REQUIRE(ask(TYPE_STATISTICS, 0, 0, NULL, 0) == 0x89);
    hello(6);
    REQUIRE(token == first && counters.value[COUNTER_SESSIONS] == 2);
    /* A copy after the end begins no session. */
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    hello(6);
    REQUIRE(token == first && counters.value[COUNTER_SESSIONS] == 2);
    ask(TYPE_STATUS, 1, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    hello(7);
    REQUIRE(token != first && counters.value[COUNTER_SESSIONS] == 3);
    /* A request of another session is refused. */
    first = token;
    token = first + 1;
    ask(TYPE_STATISTICS, 0, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    hello(7);
    REQUIRE(token == first);
}

static void test_tokens_differ(void)
{
    uint32_t before = 0;

    set_up();
    for (uint32_t nonce = 0; nonce < 100000; nonce++) {
        hello(nonce % 7);
        ask(TYPE_STATUS, 1, 0, NULL, 0);
        REQUIRE(token != 0 && token != before);
        before = token;
    }
}

/* A token equal to the previous one is drawn again. */
static void test_token_is_not_the_one_before(void)
{
    static const uint8_t nonce[4] = {1, 2, 3, 4};
    message_t            request  = {.version = 1, .type = TYPE_HELLO, .length = 4, .payload = nonce};
    uint8_t              payload[PROTOCOL_CHUNK_SIZE];
    session_t            before;
    uint32_t             drawn;

    set_up();
    before = session;
    REQUIRE(session_handle(&session, 5, &peer, &request, &reply, payload));
    drawn         = session.token;
    session       = before;
    session.token = drawn;
    REQUIRE(session_handle(&session, 5, &peer, &request, &reply, payload));
    REQUIRE(session.token != drawn && session.token != 0);
}

static void test_hello_takes_over(void)
{
    set_up();
    hello(1);
    make_frame(1, FRAME_MATCHING);
    make_frame(2, FRAME_READY);
    make_frame(3, FRAME_LOADING);
    REQUIRE(open_frame(4, 61, 43) == TYPE_ERROR);
    require_error(ERROR_NO_SLOT, SLOTS);
    hello(2);
    REQUIRE(stops == 1 && counters.value[COUNTER_FRAMES_RECLAIMED] == 3);
    REQUIRE(counters.value[COUNTER_FRAMES_RELEASED] == 0);
    for (unsigned slot = 0; slot < SLOTS; slot++) {
        REQUIRE(pool.frame[slot].state == FRAME_EMPTY);
    }
    REQUIRE(session.settings.disparities == 64 && session.settings.block_size == 9);
}

/* The link does not touch the console's slots. */
static void test_console_keeps_its_slot(void)
{
    stereo_settings_t settings = {.width = 10, .height = 10};
    frame_t         *frame;

    set_up();
    REQUIRE(frame_pool_open(&pool, FRAME_OWNER_CONSOLE, 1, &settings, &frame) == STATUS_OK);
    hello(1);
    REQUIRE(frame->state == FRAME_LOADING);
    ask(TYPE_RELEASE, 1, 0, NULL, 0);
    REQUIRE(frame->state == FRAME_LOADING);
    ask(TYPE_BYE, 0, 0, NULL, 0);
    REQUIRE(frame->state == FRAME_LOADING);
}

static void test_bye(void)
{
    set_up();
    hello(1);
    make_frame(1, FRAME_MATCHING);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a && reply.length == 0);
    REQUIRE(stops == 1 && counters.value[COUNTER_FRAMES_RELEASED] == 1);
    REQUIRE(ask(TYPE_BYE, 0, 0, NULL, 0) == 0x8a);
    ask(TYPE_STATUS, 1, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    hello(2);
    REQUIRE(counters.value[COUNTER_SESSIONS] == 2);
}

static void test_no_session(void)
{
    set_up();
    for (uint8_t type = TYPE_CONFIGURE; type <= TYPE_MISSING; type++) {
        static const uint32_t tokens[] = {0, 1, 0xffffffff};

        for (size_t i = 0; i < 3; i++) {
            token = tokens[i];
            ask(type, 1, 0, NULL, 0);
            require_error(ERROR_SESSION, 0);
        }
    }
    REQUIRE(counters.value[COUNTER_REQUESTS_REFUSED] == 30);
}

static void test_version_and_type(void)
{
    message_t request = {.version = 2, .type = TYPE_HELLO, .session = 9, .sequence = 8, .frame_id = 7, .offset = 6};
    uint8_t   payload[PROTOCOL_CHUNK_SIZE];

    set_up();
    REQUIRE(session_handle(&session, 0, &peer, &request, &reply, payload));
    require_error(ERROR_VERSION, 1);
    REQUIRE(reply.version == 1 && reply.session == 9 && reply.sequence == 8);
    REQUIRE(reply.frame_id == 7 && reply.offset == 6);
    for (unsigned type = 0; type < 256; type++) {
        request.version = 1;
        request.type    = (uint8_t)type;
        if (type >= 0x80) {
            REQUIRE(!session_handle(&session, 0, &peer, &request, &reply, payload));
        } else if (type == 0 || (type > TYPE_MISSING && type != TYPE_RESTART)) {
            REQUIRE(session_handle(&session, 0, &peer, &request, &reply, payload));
            require_error(ERROR_TYPE, type);
        }
    }
    REQUIRE(counters.value[COUNTER_HEADER_ERRORS] == 128);
}

/* Every type whose payload has a fixed length refuses every other length. */
static void test_lengths(void)
{
    static const struct {
        uint8_t  type;
        uint32_t length;
    } fixed[] = {
        {TYPE_HELLO, 4}, {TYPE_OPEN, 4}, {TYPE_START, 0}, {TYPE_STATUS, 0}, {TYPE_READ, 4}, {TYPE_RELEASE, 0},
        {TYPE_STATISTICS, 0}, {TYPE_BYE, 0}, {TYPE_MISSING, 0},
    };
    static const uint8_t payload[PROTOCOL_CHUNK_SIZE];

    set_up();
    hello(1);
    for (size_t i = 0; i < sizeof(fixed) / sizeof(fixed[0]); i++) {
        for (uint32_t length = 0; length <= PROTOCOL_CHUNK_SIZE; length++) {
            if (length != fixed[i].length) {
                ask(fixed[i].type, 1, 0, payload, length);
                require_error(ERROR_LENGTH, fixed[i].length);
            }
        }
    }
    for (uint32_t length = 1; length <= 33; length++) {
        if (length % 8 != 0) {
            ask(TYPE_CONFIGURE, 0, 0, payload, length);
            require_error(ERROR_LENGTH, length / 8 * 8);
        }
    }
}

static void test_configure(void)
{
    uint8_t payload[16];

    set_up();
    hello(1);
    REQUIRE(session.settings.disparities == 64 && session.settings.block_size == 9);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 0) == 0x82 && reply.length == 0);
    for (int32_t value = -40; value < 300; value++) {
        bool disparities = value >= 16 && value <= 64 && value % 16 == 0;
        bool block_size  = value >= 5 && value <= 21 && value % 2 == 1;

        put_parameter(payload, PARAMETER_DISPARITIES, value);
        REQUIRE((ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82) == disparities);
        if (!disparities) {
            require_error(ERROR_RANGE, PARAMETER_DISPARITIES);
        }
        put_parameter(payload, PARAMETER_BLOCK_SIZE, value);
        REQUIRE((ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82) == block_size);
        if (!block_size) {
            require_error(ERROR_RANGE, PARAMETER_BLOCK_SIZE);
        }
    }
    REQUIRE(session.settings.disparities == 64 && session.settings.block_size == 21);
    put_parameter(payload, PARAMETER_BLOCK_SIZE, 261);  /* 5 in its low byte. */
    ask(TYPE_CONFIGURE, 0, 0, payload, 8);
    require_error(ERROR_RANGE, PARAMETER_BLOCK_SIZE);
    put_parameter(payload, PARAMETER_DISPARITIES, 32);
    put_parameter(payload + 8, 11, 1);
    ask(TYPE_CONFIGURE, 0, 0, payload, 16);
    require_error(ERROR_PARAMETER, 11);
    put_parameter(payload + 8, 0, 1);
    ask(TYPE_CONFIGURE, 0, 0, payload, 16);
    require_error(ERROR_PARAMETER, 0);
    REQUIRE(session.settings.disparities == 64);  /* All are checked before one is set. */
    put_parameter(payload + 8, PARAMETER_BLOCK_SIZE, 7);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 16) == 0x82);
    REQUIRE(session.settings.disparities == 32 && session.settings.block_size == 7);
}

/* Smallest and largest value of each other parameter, and cv2.StereoBM's default, with which a session begins. */
static const struct {
    uint16_t parameter;
    int32_t  least, most, usual;
    uint32_t feature;
} ranges[] = {
    {PARAMETER_MIN_DISPARITY,     0,  255,     0,  LITESTEREO_FEATURE_MIN_DISPARITY},
    {PARAMETER_PREFILTER,         0,  1,       1,  LITESTEREO_FEATURE_XSOBEL},
    {PARAMETER_PREFILTER_CAP,     1,  63,      31, 0},
    {PARAMETER_TEXTURE_THRESHOLD, 0,  0xfffff, 10, LITESTEREO_FEATURE_TEXTURE},
    {PARAMETER_UNIQUENESS_RATIO,  0,  100,     15, LITESTEREO_FEATURE_UNIQUENESS},
    {PARAMETER_DISP12_MAX_DIFF,   -1, 254,     -1, LITESTEREO_FEATURE_LEFT_RIGHT},
    {PARAMETER_SUBPIXEL,          0,  1,       1,  LITESTEREO_FEATURE_SUBPIXEL},
    {PARAMETER_MEDIAN,            0,  1,       0,  LITESTEREO_FEATURE_MEDIAN},
};

static void test_ranges(void)
{
    uint8_t payload[8];

    for (size_t i = 0; i < sizeof(ranges) / sizeof(ranges[0]); i++) {
        uint16_t       parameter = ranges[i].parameter;
        stereo_field_t field     = (stereo_field_t)(STEREO_FIELD_DISPARITIES + parameter - PARAMETER_DISPARITIES);
        const int32_t  values[]  = {ranges[i].least, ranges[i].most, ranges[i].least - 1, ranges[i].most + 1,
            ranges[i].most + 0x10000, INT32_MIN, INT32_MAX};

        set_up();
        hello(1);
        REQUIRE(stereo_settings_get(&session.settings, field) == ranges[i].usual);
        for (size_t j = 0; j < sizeof(values) / sizeof(values[0]); j++) {
            put_parameter(payload, parameter, values[j]);
            ask(TYPE_CONFIGURE, 0, 0, payload, 8);
            if (j < 2) {
                REQUIRE(reply.type == 0x82 && stereo_settings_get(&session.settings, field) == values[j]);
            } else {
                require_error(ERROR_RANGE, parameter);
            }
        }
    }
}

/* A value that needs a missing stage gets another error than one out of range; the stage is off at the session's
 * begin. */
static void test_features(void)
{
    device_info_t usual = device_info;
    uint8_t       payload[8];

    for (size_t i = 0; i < sizeof(ranges) / sizeof(ranges[0]); i++) {
        uint16_t parameter = ranges[i].parameter;

        if (ranges[i].feature == 0) {
            continue;
        }
        device_info.limits.features = 0xff & ~ranges[i].feature;
        set_up();
        hello(1);
        REQUIRE(stereo_settings_check(&session.settings, &device_info.limits) == STEREO_FIELD_NONE);
        put_parameter(payload, parameter, ranges[i].most);
        ask(TYPE_CONFIGURE, 0, 0, payload, 8);
        require_error(ERROR_FEATURE, parameter);
        put_parameter(payload, parameter, ranges[i].most + 1);
        ask(TYPE_CONFIGURE, 0, 0, payload, 8);
        require_error(ERROR_RANGE, parameter);
        put_parameter(payload, parameter, ranges[i].least);
        REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82);
    }
    device_info.limits.features = LITESTEREO_FEATURE_XSOBEL;
    set_up();
    hello(1);
    put_parameter(payload, PARAMETER_PREFILTER, 0);
    ask(TYPE_CONFIGURE, 0, 0, payload, 8);
    require_error(ERROR_FEATURE, PARAMETER_PREFILTER);
    device_info = usual;
}

static void test_small_device(void)
{
    device_info_t usual = device_info;
    uint8_t       payload[8];

    device_info.limits.max_block_size = 7;
    set_up();
    REQUIRE(session.settings.block_size == 7);
    /* And a device with a larger smallest block. */
    device_info.limits.min_block_size = 7;
    set_up();
    hello(1);
    put_parameter(payload, PARAMETER_BLOCK_SIZE, 5);
    ask(TYPE_CONFIGURE, 0, 0, payload, 8);
    require_error(ERROR_RANGE, PARAMETER_BLOCK_SIZE);
    put_parameter(payload, PARAMETER_BLOCK_SIZE, 7);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82);
    device_info = usual;
}

/* A device built for smaller sums tells its largest cap, and refuses any above. */
static void test_smaller_cap(void)
{
    device_info_t usual = device_info;
    uint8_t       payload[8];
    bool          told = false;

    device_info.limits.max_prefilter_cap = 36;
    set_up();
    hello(1);
    for (uint32_t at = PROTOCOL_CAPABILITIES_SIZE; at < reply.length; at += PROTOCOL_CAPABILITY_SIZE) {
        told |= get_u16(reply.payload + at) == LITESTEREO_CAPABILITY_MAX_PREFILTER_CAP
            && get_u32(reply.payload + at + 4) == 36;
    }
    REQUIRE(told);
    put_parameter(payload, PARAMETER_PREFILTER_CAP, 37);
    ask(TYPE_CONFIGURE, 0, 0, payload, 8);
    require_error(ERROR_RANGE, PARAMETER_PREFILTER_CAP);
    put_parameter(payload, PARAMETER_PREFILTER_CAP, 36);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, payload, 8) == 0x82);
    device_info = usual;
}

/* A name as long as its field has no zero at the end, and a longer one is cut. */
static void test_long_name(void)
{
    device_info_t usual = device_info;

    device_info.name = "seventeen letters";
    set_up();
    hello(1);
    REQUIRE(memcmp(reply.payload + PROTOCOL_NAME_OFFSET, "seventeen letter", PROTOCOL_NAME_SIZE) == 0);
    device_info = usual;
}

/* Values after the fixed fields: a pair for each but those that are 0. */
static void test_more_capabilities(void)
{
    device_info_t  usual = device_info;
    const uint8_t *pair;

    set_up();
    hello(1);
    REQUIRE(reply.length == PROTOCOL_CAPABILITIES_SIZE);
    device_info.dma_alignment = 0x01020304;
    set_up();
    hello(1);
    REQUIRE(reply.length == PROTOCOL_CAPABILITIES_SIZE + PROTOCOL_CAPABILITY_SIZE);
    pair = reply.payload + PROTOCOL_CAPABILITIES_SIZE;
    REQUIRE(get_u16(pair) == LITESTEREO_CAPABILITY_DMA_ALIGNMENT && get_u16(pair + 2) == 0);
    REQUIRE(get_u32(pair + 4) == 0x01020304);
    device_info = usual;
}

static void test_statistics(void)
{
    set_up();
    hello(1);
    counters.value[COUNTER_CONSOLE_LINES] = 0x01020304;
    REQUIRE(ask(TYPE_STATISTICS, 0, 0, NULL, 0) == 0x89 && reply.length == 4 * 28);
    REQUIRE(get_u32(reply.payload) == 2 && get_u32(reply.payload + 4) == 1);
    REQUIRE(get_u32(reply.payload + 8 * 4) == 1 && get_u32(reply.payload + 19 * 4) == 0x01020304);
}

int main(void)
{
    test_hello();
    test_hello_again();
    test_tokens_differ();
    test_token_is_not_the_one_before();
    test_hello_takes_over();
    test_console_keeps_its_slot();
    test_bye();
    test_no_session();
    test_version_and_type();
    test_lengths();
    test_configure();
    test_ranges();
    test_features();
    test_small_device();
    test_smaller_cap();
    test_long_name();
    test_more_capabilities();
    test_statistics();
    return 0;
}
