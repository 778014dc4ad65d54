/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about the device's calibration. */

#include <string.h>

#include "exchange.h"
#include "lib/bytes.h"

static void put_state(const calibrate_t *calibrate, exchange_t *exchange)
{
    const rectification_t *rectification = calibrate->rectification;
    const calibration_t   *in_use        = &rectification->calibration;
    uint8_t               *out           = exchange->payload;

    memset(out, 0, PROTOCOL_CALIBRATION_SIZE);
    out[0] = (uint8_t)calibrate->state;
    out[1] = (uint8_t)calibrate->failure;
    out[2] = calibrate->kept;
    put_u16(out + 4, rectification->rows_needed);
    put_u16(out + 6, rectification->rows);
    put_u16(out + 8, in_use->width);
    put_u16(out + 10, in_use->height);
    put_u32(out + 12, in_use->grid_crc);
    put_u32(out + 16, in_use->size);
    put_u32(out + 20, CALIBRATE_ROOM);
    exchange->length = PROTOCOL_CALIBRATION_SIZE;
}

void session_calibrate(session_t *session, exchange_t *exchange)
{
    calibrate_t   *calibrate = session->calibrate;
    const uint8_t *payload   = exchange->request->payload;

    switch (calibrate_begin(calibrate, get_u32(payload), get_u32(payload + 4))) {
    case STATUS_OK:
        put_state(calibrate, exchange);
        break;
    case STATUS_SIZE:
        refuse(exchange, ERROR_SIZE, SIZE_TOO_LONG);
        break;
    default:
        refuse(exchange, ERROR_STATE, calibrate->state);
        break;
    }
}

void session_record(session_t *session, exchange_t *exchange)
{
    const message_t *request   = exchange->request;
    calibrate_t     *calibrate = session->calibrate;

    switch (calibrate_store(calibrate, request->offset, request->payload, request->length)) {
    case STATUS_OK:
        break;
    case STATUS_STATE:
        refuse(exchange, ERROR_STATE, calibrate->state);
        break;
    case STATUS_LENGTH:
        refuse(exchange, ERROR_LENGTH, calibrate_chunk_length(calibrate, request->offset));
        break;
    default:
        refuse(exchange, ERROR_OFFSET, request->offset);
        break;
    }
}

void session_adopt(session_t *session, exchange_t *exchange)
{
    calibrate_t *calibrate = session->calibrate;

    switch (calibrate_adopt(calibrate, get_u32(exchange->request->payload) != 0)) {
    case STATUS_OK:
        put_state(calibrate, exchange);
        break;
    case STATUS_UNSUPPORTED:
        refuse(exchange, ERROR_FLASH, 0);
        break;
    default:
        refuse(exchange, ERROR_STATE, calibrate->state);
        break;
    }
}

void session_calibration(session_t *session, exchange_t *exchange)
{
    put_state(session->calibrate, exchange);
}

void session_recall(session_t *session, exchange_t *exchange)
{
    const calibration_t *in_use = &session->calibrate->rectification->calibration;
    uint32_t             offset = exchange->request->offset;
    uint32_t             length = get_u32(exchange->request->payload);

    if (in_use->width == 0) {
        refuse(exchange, ERROR_CALIBRATION, 0);
    } else if (length == 0 || length > PROTOCOL_CHUNK_SIZE) {
        refuse(exchange, ERROR_LENGTH, PROTOCOL_CHUNK_SIZE);
    } else if (offset >= in_use->size || length > in_use->size - offset) {
        refuse(exchange, ERROR_OFFSET, offset);
    } else {
        copy_bytes(exchange->payload, in_use->record + offset, length);
        exchange->length = length;
    }
}

void session_forget(session_t *session, exchange_t *exchange)
{
    calibrate_t *calibrate = session->calibrate;
    bool         busy      = session->update != NULL && update_is_running(session->update);

    switch (busy ? STATUS_STATE : calibrate_forget(calibrate)) {
    case STATUS_OK:
        put_state(calibrate, exchange);
        break;
    case STATUS_STATE:
        refuse(exchange, ERROR_STATE, busy ? session->update->state : calibrate->state);
        break;
    case STATUS_BUSY:
        refuse(exchange, ERROR_STATE, CALIBRATE_WRITING);
        break;
    default:
        refuse(exchange, ERROR_FLASH, 0);
        break;
    }
}
