/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "session.h"

#include <string.h>

#include "exchange.h"
#include "lib/bytes.h"

#define ANY_LENGTH 0xffffffffu

/* Handler of each type of request; a type without one is unknown. */
static const struct {
    void   (*handle)(session_t *session, exchange_t *exchange);
    uint32_t length;  /* Bytes of payload; ANY_LENGTH if the handler checks it. */
} requests[] = {
    [TYPE_HELLO]      = {session_hello, 4},
    [TYPE_CONFIGURE]  = {session_configure, ANY_LENGTH},
    [TYPE_OPEN]       = {session_open, ANY_LENGTH},
    [TYPE_UPLOAD]     = {session_upload, ANY_LENGTH},
    [TYPE_START]      = {session_start, 0},
    [TYPE_STATUS]     = {session_status, 0},
    [TYPE_READ]       = {session_read, 4},
    [TYPE_RELEASE]    = {session_release, 0},
    [TYPE_STATISTICS] = {session_statistics, 0},
    [TYPE_BYE]        = {session_bye, 0},
    [TYPE_MISSING]    = {session_missing, 0},
    [TYPE_STREAM]     = {session_stream, ANY_LENGTH},
    [TYPE_UPDATE]     = {session_update, 8},
    [TYPE_IMAGE]      = {session_image, ANY_LENGTH},
    [TYPE_WRITE]      = {session_write, 0},
    [TYPE_PROGRESS]   = {session_progress, 0},
    [TYPE_RESTART]    = {session_restart, 0},
    [TYPE_CALIBRATE]   = {session_calibrate, 8},
    [TYPE_RECORD]      = {session_record, ANY_LENGTH},
    [TYPE_ADOPT]       = {session_adopt, 4},
    [TYPE_CALIBRATION] = {session_calibration, 0},
    [TYPE_RECALL]      = {session_recall, 4},
    [TYPE_FORGET]      = {session_forget, 0},
};

static void set_defaults(session_t *session)
{
    session->settings = stereo_settings_default(&session->info->limits);
}

void session_init(session_t *session, const device_info_t *info, frame_pool_t *pool, counters_t *counters,
    session_stop_t stop, void *context)
{
    *session = (session_t){
        .info     = info,
        .pool     = pool,
        .counters = counters,
        .stop     = stop,
        .context  = context,
        .random   = 1,
    };
    set_defaults(session);
}

/* Xorshift32 with a value mixed in. A token has to differ from those of other boots, not to withstand guessing. */
static uint32_t next_random(session_t *session, uint32_t with)
{
    session->random ^= with;
    session->random += session->random == 0;
    session->random ^= session->random << 13;
    session->random ^= session->random >> 17;
    session->random ^= session->random << 5;
    return session->random;
}

static uint32_t draw_token(session_t *session, uint32_t nonce)
{
    uint32_t token = next_random(session, nonce);

    while (token == 0 || token == session->token) {
        token = next_random(session, 0);
    }
    return token;
}

static uint32_t features(const session_t *session)
{
    uint32_t of_matcher = session->info->limits.features & ~(LITESTEREO_FEATURE_STREAMING | LITESTEREO_FEATURE_UPDATE
        | (session->calibrate == NULL ? LITESTEREO_FEATURE_RECTIFICATION : 0));

    return of_matcher | (session_stream_path(session, &session->peer) != NULL ? LITESTEREO_FEATURE_STREAMING : 0)
        | (session->update != NULL ? LITESTEREO_FEATURE_UPDATE : 0);
}

/* Value that comes after the fixed fields; 0 if the device has none of that number. */
static uint32_t capability(const session_t *session, unsigned number)
{
    switch (number) {
    case LITESTEREO_CAPABILITY_DMA_ALIGNMENT:
        return session->info->dma_alignment;
    case LITESTEREO_CAPABILITY_UPDATE_BYTES:
        return session->update != NULL ? update_room(session->update) : 0;
    case LITESTEREO_CAPABILITY_MAX_PREFILTER_CAP:
        return session->info->limits.max_prefilter_cap;
    case LITESTEREO_CAPABILITY_RECTIFICATION_ROWS:
        return session->calibrate != NULL ? session->calibrate->rectification->rows : 0;
    case LITESTEREO_CAPABILITY_RECTIFICATION_HEIGHT:
        return session->calibrate != NULL ? session->calibrate->rectification->max_height : 0;
    default:
        return 0;
    }
}

/* Appends all values but 0, and returns their length in bytes. */
static uint32_t put_more_capabilities(const session_t *session, uint8_t *payload)
{
    uint32_t length = 0;

    for (unsigned number = 1; number <= LITESTEREO_CAPABILITIES; number++) {
        uint32_t value = capability(session, number);

        if (value != 0) {
            put_u16(payload + length, (uint16_t)number);
            put_u16(payload + length + 2, 0);
            put_u32(payload + length + 4, value);
            length += PROTOCOL_CAPABILITY_SIZE;
        }
    }
    return length;
}

/* Returns the length of the payload. */
static uint32_t put_capabilities(const session_t *session, uint8_t *payload)
{
    const device_info_t *info = session->info;

    memset(payload, 0, PROTOCOL_CAPABILITIES_SIZE);
    put_u32(payload + 0, session->token);
    put_u32(payload + 4, session->nonce);
    put_u16(payload + 8, info->gateware_version);
    put_u16(payload + 10, info->firmware_version);
    put_u16(payload + 12, info->max_width);
    put_u16(payload + 14, info->max_height);
    put_u16(payload + 16, info->limits.max_disparities);
    payload[18] = info->limits.min_block_size;
    payload[19] = info->limits.max_block_size;
    put_u32(payload + 20, features(session));
    put_u32(payload + 24, session_max_pixels(session));
    put_u16(payload + 28, session->pool->slots);
    put_u16(payload + 30, PROTOCOL_CHUNK_SIZE);
    put_u32(payload + 32, info->sys_clk_hz);
    for (unsigned i = 0; i < PROTOCOL_NAME_SIZE && info->name[i] != 0; i++) {
        payload[PROTOCOL_NAME_OFFSET + i] = (uint8_t)info->name[i];
    }
    return PROTOCOL_CAPABILITIES_SIZE + put_more_capabilities(session, payload + PROTOCOL_CAPABILITIES_SIZE);
}

/* Has gateware accept the chunks of this session if it is open and at UDP, and no others. */
static void set_transfer_session(const session_t *session)
{
    if (session->transfer != NULL) {
        uint32_t token = session->open && session->peer.udp ? session->token : 0;

        session->transfer->set_session(session->transfer->context, token, &session->peer);
    }
}

/* Drops a firmware and a calibration that the previous host left in memory, unless they are being written. */
static void forget_update(const session_t *session)
{
    if (session->update != NULL) {
        update_forget(session->update);
    }
    if (session->calibrate != NULL) {
        calibrate_discard(session->calibrate);
    }
}

void session_hello(session_t *session, exchange_t *exchange)
{
    uint32_t nonce = get_u32(exchange->request->payload);
    bool     again = session->token != 0 && session->nonce == nonce && peer_is(&session->peer, exchange->peer);

    /* A late copy of the HELLO, even after the session's end, begins no session; nor does one of an earlier session. */
    if (!again && session_has_said_hello(session, exchange->peer, nonce)) {
        exchange->no_reply = true;
        return;
    }
    if (!again) {
        session_remember_hello(session);
        session_free_all(session, COUNTER_FRAMES_RECLAIMED);
        session->token = draw_token(session, nonce);
        session->nonce = nonce;
        session->open  = true;
        session->peer  = *exchange->peer;
        session->heard = exchange->clock;
        session->departed_count = 0;
        forget_update(session);
        set_defaults(session);
        set_transfer_session(session);
        count(session->counters, COUNTER_SESSIONS);
    }
    exchange->length = put_capabilities(session, exchange->payload);
}

/* Parameters are numbered in the order of the fields that they set. */
_Static_assert(STEREO_FIELD_LAST - STEREO_FIELD_FIRST == PARAMETER_LAST - PARAMETER_FIRST,
    "each field has its parameter");

/* Applies one entry of a CONFIGURE to `settings`, or refuses it and returns false. */
static bool configure(const session_t *session, exchange_t *exchange, const uint8_t *entry, stereo_settings_t *settings)
{
    uint16_t       parameter = get_u16(entry);
    stereo_field_t field     = (stereo_field_t)(STEREO_FIELD_FIRST + parameter - PARAMETER_FIRST);

    if (parameter < PARAMETER_FIRST || parameter > PARAMETER_LAST) {
        refuse(exchange, ERROR_PARAMETER, parameter);
        return false;
    }
    switch (stereo_settings_set(settings, &session->info->limits, field, (int32_t)get_u32(entry + 4))) {
    case STATUS_OK:
        return true;
    case STATUS_UNSUPPORTED:
        refuse(exchange, ERROR_FEATURE, parameter);
        return false;
    default:
        refuse(exchange, ERROR_RANGE, parameter);
        return false;
    }
}

void session_configure(session_t *session, exchange_t *exchange)
{
    const message_t  *request  = exchange->request;
    const uint8_t    *end      = request->payload + request->length;
    stereo_settings_t settings = session->settings;

    if (request->length % PROTOCOL_PARAMETER_SIZE != 0) {
        refuse(exchange, ERROR_LENGTH, request->length / PROTOCOL_PARAMETER_SIZE * PROTOCOL_PARAMETER_SIZE);
        return;
    }
    for (const uint8_t *entry = request->payload; entry < end; entry += PROTOCOL_PARAMETER_SIZE) {
        if (!configure(session, exchange, entry, &settings)) {
            return;
        }
    }
    /* All entries take effect, or none. */
    session->settings = settings;
}

void session_statistics(session_t *session, exchange_t *exchange)
{
    session_update_counters(session, exchange->clock);
    for (unsigned i = 0; i < COUNTERS; i++) {
        put_u32(exchange->payload + 4 * i, session->counters->value[i]);
    }
    exchange->length = 4 * COUNTERS;
}

void session_bye(session_t *session, exchange_t *exchange)
{
    (void)exchange;
    session_free_all(session, COUNTER_FRAMES_RELEASED);
    session->open = false;
    set_transfer_session(session);
}

static bool needs_flash(uint8_t type)
{
    return type == TYPE_UPDATE || type == TYPE_IMAGE || type == TYPE_WRITE || type == TYPE_PROGRESS;
}

static bool needs_rectification(uint8_t type)
{
    return type >= TYPE_CALIBRATE && type <= TYPE_FORGET;
}

/* Whether the device serves this type of request for this peer. */
static bool is_known(const session_t *session, const exchange_t *exchange)
{
    uint8_t type = exchange->request->type;

    return type < sizeof(requests) / sizeof(requests[0]) && requests[type].handle != NULL
        && (type != TYPE_STREAM || session_stream_path(session, exchange->peer) != NULL)
        && (!needs_flash(type) || session->update != NULL)
        && (!needs_rectification(type) || session->calibrate != NULL);
}

static void serve(session_t *session, exchange_t *exchange)
{
    const message_t *request = exchange->request;

    if (request->version != PROTOCOL_VERSION) {
        refuse(exchange, ERROR_VERSION, PROTOCOL_VERSION);
        return;
    }
    if (!is_known(session, exchange)) {
        refuse(exchange, ERROR_TYPE, request->type);
        return;
    }
    if (!session_admit(session, exchange)) {
        return;
    }
    if (requests[request->type].length != ANY_LENGTH && request->length != requests[request->type].length) {
        refuse(exchange, ERROR_LENGTH, requests[request->type].length);
        return;
    }
    requests[request->type].handle(session, exchange);
}

static void make_error(const session_t *session, const exchange_t *exchange, message_t *reply)
{
    count(session->counters, COUNTER_REQUESTS_REFUSED);
    reply->type   = TYPE_ERROR;
    reply->length = PROTOCOL_ERROR_SIZE;
    put_u16(exchange->payload, exchange->error);
    exchange->payload[2] = exchange->request->type;
    exchange->payload[3] = 0;
    put_u32(exchange->payload + 4, exchange->detail);
}

bool session_handle(session_t *session, uint64_t clock, const peer_t *peer, const message_t *request, message_t *reply,
    uint8_t *payload)
{
    exchange_t exchange = {.request = request, .payload = payload, .clock = clock, .peer = peer};

    (void)next_random(session, (uint32_t)clock);
    if ((request->type & PROTOCOL_REPLY_BIT) != 0) {
        count(session->counters, COUNTER_HEADER_ERRORS);
        return false;
    }
    count(session->counters, COUNTER_MESSAGES_RECEIVED);
    if (peer_is(&session->peer, peer)) {
        session->heard = clock;
    }
    /* Over UDP gateware receives the pixels. It passes on those that it cannot place; they get no reply. */
    if (peer->udp && (request->type == TYPE_UPLOAD || request->type == TYPE_PAIRS)
        && request->version == PROTOCOL_VERSION) {
        return false;
    }
    /* A session that begins now would be lost in the restart. */
    if (session->restarting && request->type != TYPE_RESTART) {
        return false;
    }
    serve(session, &exchange);
    if (exchange.no_reply || !session_may_answer(session, &exchange)) {
        return false;
    }
    *reply = (message_t){
        .version  = PROTOCOL_VERSION,
        .type     = request->type | PROTOCOL_REPLY_BIT,
        .session  = request->session,
        .sequence = request->sequence,
        .frame_id = request->frame_id,
        .offset   = request->offset,
        .length   = exchange.length,
        .payload  = payload,
    };
    if (exchange.error != ERROR_NONE) {
        make_error(session, &exchange, reply);
    }
    count(session->counters, COUNTER_MESSAGES_SENT);
    return true;
}
