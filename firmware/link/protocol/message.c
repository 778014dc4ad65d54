/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "message.h"

#include "lib/bytes.h"
#include "litestereo/crc32.h"

status_t message_parse(const uint8_t *bytes, size_t length, message_t *message)
{
    uint32_t payload;

    if (length < PROTOCOL_MESSAGE_MIN || length > PROTOCOL_MESSAGE_MAX) {
        return STATUS_FRAMING;
    }
    payload = get_u32(bytes + HEADER_LENGTH);
    if (get_u16(bytes + HEADER_MAGIC) != PROTOCOL_MAGIC || payload != length - PROTOCOL_MESSAGE_MIN) {
        return STATUS_HEADER;
    }
    length -= PROTOCOL_CRC_SIZE;
    if (crc32_update(0, bytes, length) != get_u32(bytes + length)) {
        return STATUS_CRC;
    }
    *message = (message_t){
        .version  = bytes[HEADER_VERSION],
        .type     = bytes[HEADER_TYPE],
        .session  = get_u32(bytes + HEADER_SESSION),
        .sequence = get_u32(bytes + HEADER_SEQUENCE),
        .frame_id = get_u32(bytes + HEADER_FRAME_ID),
        .offset   = get_u32(bytes + HEADER_OFFSET),
        .length   = payload,
        .payload  = bytes + PROTOCOL_HEADER_SIZE,
    };
    return STATUS_OK;
}

size_t message_build(const message_t *message, uint8_t *buffer)
{
    uint8_t *payload = buffer + PROTOCOL_HEADER_SIZE;
    size_t   length  = PROTOCOL_HEADER_SIZE + message->length;

    put_u16(buffer + HEADER_MAGIC, PROTOCOL_MAGIC);
    buffer[HEADER_VERSION] = message->version;
    buffer[HEADER_TYPE]    = message->type;
    put_u32(buffer + HEADER_SESSION, message->session);
    put_u32(buffer + HEADER_SEQUENCE, message->sequence);
    put_u32(buffer + HEADER_FRAME_ID, message->frame_id);
    put_u32(buffer + HEADER_OFFSET, message->offset);
    put_u32(buffer + HEADER_LENGTH, message->length);
    if (message->payload != payload) {
        copy_bytes(payload, message->payload, message->length);
    }
    put_u32(buffer + length, crc32_update(0, buffer, length));
    return length + PROTOCOL_CRC_SIZE;
}
