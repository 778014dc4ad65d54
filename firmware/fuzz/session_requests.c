/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "session_requests.h"

#include <string.h>

#include "drawn_calibration.h"
#include "generated/csr.h"
#include "lib/bytes.h"

/* Sets a field of the request to any number. */
#define ANY_TYPE    (1u << 0)
#define ANY_TOKEN   (1u << 1)
#define ANY_OFFSET  (1u << 2)
#define ANY_PAYLOAD (1u << 3)
#define ANY_VERSION (1u << 4)
#define ANY_FRAME   (1u << 5)
#define ANY_OPTIONS (1u << 6)

/* Most types of requests; after them come those about the calibration. */
#define COMMON 13u
#define RARE   6u

/* A byte of the input from here on asks for one of these. */
#define FIRST_RARE (16u * COMMON)

static void put_parameters(input_t *input, message_t *message, uint8_t *payload)
{
    message->length = take(input) % 4 * PROTOCOL_PARAMETER_SIZE;
    for (uint32_t at = 0; at < message->length; at += PROTOCOL_PARAMETER_SIZE) {
        uint8_t parameter = take(input);
        uint8_t value     = take(input);

        put_u16(payload + at, parameter % 12);
        put_u16(payload + at + 2, 0);
        put_u32(payload + at + 4, parameter >= 240 ? take_u32(input) : value);
    }
}

/* The next pairs of the frame that is being matched. */
static void put_pairs(const session_t *session, message_t *message)
{
    const frame_t *frame = frame_pool_matching(session->pool);
    uint32_t       rest;

    message->length = PROTOCOL_CHUNK_SIZE;
    if (frame != NULL) {
        message->frame_id = frame->id;
        message->offset   = frame_link_stream_offset_read();
        rest              = frame_map_size(frame) - message->offset;
        message->length   = rest < PROTOCOL_CHUNK_SIZE ? rest : PROTOCOL_CHUNK_SIZE;
    }
}

/* A calibration that the device accepts, or another one. */
static void put_calibration(input_t *input, message_t *message, uint8_t *payload)
{
    static uint8_t record[2048];
    int            rows = take(input) % 32;
    uint32_t       size = draw_calibration(record, 24, 20, 0, rows);

    if (message->type == TYPE_CALIBRATE) {
        put_u32(payload, size);
        put_u32(payload + 4, get_u32(record + size - 4));
        message->length = 8;
    } else {
        message->length = size < PROTOCOL_CHUNK_SIZE ? size : PROTOCOL_CHUNK_SIZE;
        memcpy(payload, record, message->length);
        message->offset = 0;
    }
}

static void put_payload(input_t *input, const session_t *session, message_t *message, uint8_t *payload)
{
    frame_t *frame = frame_pool_find(session->pool, FRAME_OWNER_LINK, message->frame_id);

    switch (message->type) {
    case TYPE_HELLO:
        put_u32(payload, take(input));
        message->length = 4;
        break;
    case TYPE_CONFIGURE:
        put_parameters(input, message, payload);
        break;
    case TYPE_OPEN:
    case TYPE_STREAM:
        put_u16(payload, take(input));
        put_u16(payload + 2, take(input) % 64);
        message->length = 4;
        break;
    case TYPE_UPLOAD:
        message->length = frame != NULL ? frame_chunk_length(frame, message->offset) : PROTOCOL_CHUNK_SIZE;
        break;
    case TYPE_PAIRS:
        put_pairs(session, message);
        break;
    case TYPE_READ:
        put_u32(payload, take(input) * 16u);
        message->length = 4;
        break;
    case TYPE_CALIBRATE:
    case TYPE_RECORD:
        put_calibration(input, message, payload);
        break;
    case TYPE_ADOPT:
    case TYPE_RECALL:
        put_u32(payload, take(input));
        message->length = 4;
        break;
    default:
        break;
    }
}

message_t take_request(input_t *input, const session_t *session, uint8_t *payload)
{
    uint8_t   type    = take(input);
    uint8_t   any     = take(input);
    uint8_t   place   = take(input);
    message_t message = {
        .version  = PROTOCOL_VERSION,
        .type     = type < FIRST_RARE ? 1 + type % COMMON : TYPE_CALIBRATE + type % RARE,
        .session  = session->token,
        .sequence = place / 8 % 8,
        .frame_id = place % 4,
        .offset   = place / 4 % 16 * PROTOCOL_CHUNK_SIZE,
        .payload  = payload,
    };

    memset(payload, place, PROTOCOL_CHUNK_SIZE);
    message.type     = (any & ANY_TYPE) != 0 ? type : message.type;
    message.version  = (any & ANY_VERSION) != 0 ? take(input) : message.version;
    message.session  = (any & ANY_TOKEN) != 0 || message.type == TYPE_HELLO ? take(input) : message.session;
    message.frame_id = (any & ANY_FRAME) != 0 ? take_u32(input) : message.frame_id;
    put_payload(input, session, &message, payload);
    if ((any & ANY_OPTIONS) != 0 && (message.type == TYPE_OPEN || message.type == TYPE_STREAM)) {
        put_u16(payload + 4, take(input) % (OPTIONS_ALL + 2));
        message.length = 8;
    }
    message.offset   = (any & ANY_OFFSET) != 0 ? take_u32(input) : message.offset;
    if ((any & ANY_PAYLOAD) != 0) {
        message.length = take_u32(input) % (PROTOCOL_CHUNK_SIZE + 1);
        for (uint32_t i = 0; i < message.length && i < 16; i++) {
            payload[i] = take(input);
        }
    }
    return message;
}
