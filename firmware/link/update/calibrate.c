/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "calibrate.h"

#include <stddef.h>

#include "lib/bytes.h"
#include "link/protocol/protocol.h"
#include "litestereo/crc32.h"

void calibrate_init(calibrate_t *calibrate, rectification_t *rectification, records_t *records, uint8_t *memory)
{
    *calibrate = (calibrate_t){
        .rectification = rectification,
        .records       = records,
        .memory        = {memory, memory + CALIBRATE_ROOM},
    };
}

static uint8_t *announced(const calibrate_t *calibrate)
{
    return calibrate->memory[calibrate->announced];
}

status_t calibrate_recall(calibrate_t *calibrate)
{
    uint32_t size   = 0;
    status_t status = STATUS_NO_RECORD;

    if (calibrate->records != NULL) {
        status = records_read(calibrate->records, RECORD_CALIBRATION, announced(calibrate), CALIBRATE_ROOM, &size);
    }
    if (status == STATUS_OK) {
        status = rectification_use(calibrate->rectification, announced(calibrate), size);
    }
    if (status == STATUS_OK) {
        calibrate->announced ^= 1u;
        calibrate->kept       = true;
    }
    return status;
}

bool calibrate_is_running(const calibrate_t *calibrate)
{
    return calibrate->state == CALIBRATE_CHECKING || calibrate->state == CALIBRATE_WRITING;
}

status_t calibrate_begin(calibrate_t *calibrate, uint32_t length, uint32_t crc32)
{
    bool known = calibrate->state != CALIBRATE_EMPTY && calibrate->state != CALIBRATE_FAILED;

    if (known && calibrate->length == length && calibrate->crc32 == crc32) {
        return STATUS_OK;
    }
    if (calibrate_is_running(calibrate)) {
        return STATUS_STATE;
    }
    if (length == 0 || length > CALIBRATE_ROOM) {
        return STATUS_SIZE;
    }
    calibrate->state   = CALIBRATE_LOADING;
    calibrate->failure = CALIBRATE_NO_FAILURE;
    calibrate->length  = length;
    calibrate->crc32   = crc32;
    return STATUS_OK;
}

uint32_t calibrate_chunk_length(const calibrate_t *calibrate, uint32_t offset)
{
    if (offset % PROTOCOL_CHUNK_SIZE != 0 || offset >= calibrate->length) {
        return 0;
    }
    return calibrate->length - offset < PROTOCOL_CHUNK_SIZE ? calibrate->length - offset : PROTOCOL_CHUNK_SIZE;
}

status_t calibrate_store(calibrate_t *calibrate, uint32_t offset, const uint8_t *chunk, uint32_t length)
{
    uint32_t expected = calibrate_chunk_length(calibrate, offset);

    if (calibrate->state != CALIBRATE_LOADING) {
        return STATUS_STATE;
    }
    if (expected == 0) {
        return STATUS_OFFSET;
    }
    if (length != expected) {
        return STATUS_LENGTH;
    }
    copy_bytes(announced(calibrate) + offset, chunk, length);
    return STATUS_OK;
}

static void fail(calibrate_t *calibrate, calibrate_failure_t failure)
{
    calibrate->state   = CALIBRATE_FAILED;
    calibrate->failure = failure;
}

static calibrate_failure_t failure_of(status_t status)
{
    switch (status) {
    case STATUS_SIZE:
        return CALIBRATE_SIZE;
    case STATUS_BAD_ARGUMENT:
        return CALIBRATE_FOLDED;
    case STATUS_ROWS:
        return CALIBRATE_ROWS;
    default:
        return CALIBRATE_FORMAT;
    }
}

status_t calibrate_adopt(calibrate_t *calibrate, bool keep)
{
    status_t status;

    if (calibrate->state == CALIBRATE_EMPTY) {
        return STATUS_STATE;
    }
    if (keep && calibrate->records == NULL) {
        return STATUS_UNSUPPORTED;
    }
    if (calibrate->state != CALIBRATE_LOADING) {
        return STATUS_OK;
    }
    calibrate->keep = keep;
    /* The record ends with that checksum, and a checksum of both would be the same for all records. */
    if (calibrate->length < CALIBRATION_CRC_BYTES
        || crc32_update(0, announced(calibrate), calibrate->length - CALIBRATION_CRC_BYTES) != calibrate->crc32) {
        fail(calibrate, CALIBRATE_CHECKSUM);
        return STATUS_OK;
    }
    status = rectification_begin(calibrate->rectification, announced(calibrate), calibrate->length);
    if (status == STATUS_OK) {
        calibrate->state = CALIBRATE_CHECKING;
    } else {
        fail(calibrate, failure_of(status));
    }
    return STATUS_OK;
}

void calibrate_discard(calibrate_t *calibrate)
{
    if (!calibrate_is_running(calibrate)) {
        calibrate->state   = CALIBRATE_EMPTY;
        calibrate->failure = CALIBRATE_NO_FAILURE;
        calibrate->length  = 0;
    }
}

status_t calibrate_forget(calibrate_t *calibrate)
{
    if (calibrate_is_running(calibrate)) {
        return STATUS_STATE;
    }
    if (calibrate->records != NULL && calibrate->records->step != RECORDS_IDLE) {
        return STATUS_BUSY;
    }
    calibrate_discard(calibrate);
    rectification_forget(calibrate->rectification);
    calibrate->kept = false;
    return calibrate->records != NULL ? records_erase(calibrate->records, RECORD_CALIBRATION) : STATUS_OK;
}

static void check(calibrate_t *calibrate)
{
    status_t status = rectification_poll(calibrate->rectification);

    if (status == STATUS_BUSY) {
        return;
    }
    if (status != STATUS_OK) {
        fail(calibrate, failure_of(status));
        return;
    }
    /* The memory of the announced calibration is that of the one in use now. */
    calibrate->announced ^= 1u;
    calibrate->kept       = false;
    calibrate->writing    = false;
    calibrate->state      = calibrate->keep ? CALIBRATE_WRITING : CALIBRATE_DONE;
}

static void write(calibrate_t *calibrate, uint64_t clock)
{
    const calibration_t *in_use = &calibrate->rectification->calibration;
    status_t             status;

    /* Another record may be under way: that is BUSY too. */
    status = calibrate->writing ? records_poll(calibrate->records, clock)
                                : records_begin_write(calibrate->records, RECORD_CALIBRATION, in_use->record, in_use->size);
    if (status == STATUS_BUSY) {
        return;
    }
    if (status == STATUS_OK && !calibrate->writing) {
        calibrate->writing = true;
        return;
    }
    calibrate->kept = status == STATUS_OK;
    if (calibrate->kept) {
        calibrate->state = CALIBRATE_DONE;
    } else {
        fail(calibrate, CALIBRATE_FLASH);
    }
}

void calibrate_poll(calibrate_t *calibrate, uint64_t clock)
{
    if (calibrate->state == CALIBRATE_CHECKING) {
        check(calibrate);
    } else if (calibrate->state == CALIBRATE_WRITING) {
        write(calibrate, clock);
    }
}
