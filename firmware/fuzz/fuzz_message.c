/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The parser of messages: any bytes, and bytes with valid magic, length and CRC.
 *
 * The first byte of the input says which of the two; the rest is the message. */

#include <string.h>

#include "fuzz.h"
#include "lib/bytes.h"
#include "link/protocol/message.h"

/* The CRC by its definition, without a table. */
static uint32_t crc_of(const uint8_t *bytes, size_t length)
{
    uint32_t crc = 0xffffffff;

    for (size_t i = 0; i < length; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc >> 1 ^ (0xedb88320u & -(crc & 1));
        }
    }
    return ~crc;
}

static void seal(uint8_t *bytes, size_t length)
{
    put_u16(bytes + HEADER_MAGIC, PROTOCOL_MAGIC);
    put_u32(bytes + HEADER_LENGTH, (uint32_t)(length - PROTOCOL_MESSAGE_MIN));
    put_u32(bytes + length - PROTOCOL_CRC_SIZE, crc_of(bytes, length - PROTOCOL_CRC_SIZE));
}

static status_t expected(const uint8_t *bytes, size_t length)
{
    if (length < PROTOCOL_MESSAGE_MIN || length > PROTOCOL_MESSAGE_MAX) {
        return STATUS_FRAMING;
    }
    if (bytes[0] != 'L' || bytes[1] != 'S' || get_u32(bytes + 20) != length - 28) {
        return STATUS_HEADER;
    }
    return get_u32(bytes + length - 4) == crc_of(bytes, length - 4) ? STATUS_OK : STATUS_CRC;
}

static status_t parse(const uint8_t *bytes, size_t length, message_t *message)
{
    status_t status = message_parse(bytes, length, message);

#ifdef PLANTED_FAULT
    /* The planted fault: trusts the frame id of one type. */
    if (status == STATUS_OK && message->type == TYPE_READ && message->frame_id == 7) {
        message->length += 8;
    }
#endif
    return status;
}

/* A parsed message is within its bytes, and building it from its fields gives the same bytes. */
static void check(const uint8_t *bytes, size_t length, const message_t *message)
{
    uint8_t *built = malloc(PROTOCOL_MESSAGE_MIN + message->length);

    HOLDS(message->payload == bytes + PROTOCOL_HEADER_SIZE);
    HOLDS(message_build(message, built) == length && memcmp(built, bytes, length) == 0);
    free(built);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t   input = {data, size};
    uint8_t   how   = take(&input);
    /* Exactly as large as the message, so that the sanitizer detects reads beyond it. */
    uint8_t  *bytes = malloc(input.length);
    message_t message;
    status_t  status;

    memcpy(bytes, input.bytes, input.length);
    if ((how & 1) != 0 && input.length >= PROTOCOL_MESSAGE_MIN) {
        seal(bytes, input.length);
    }
    status = parse(bytes, input.length, &message);
    HOLDS(status == expected(bytes, input.length));
    if (status == STATUS_OK) {
        check(bytes, input.length, &message);
    }
    free(bytes);
    return 0;
}
