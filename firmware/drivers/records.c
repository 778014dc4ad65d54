/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/records.h"

#include <stddef.h>
#include <string.h>

#include "litestereo/crc32.h"
#include "litestereo/platform.h"
#include "litestereo/watchdog.h"
#include "record_copy.h"

#define PAGE   FLASH_PAGE_BYTES
#define SECTOR FLASH_SECTOR_BYTES

static uint32_t smaller(uint32_t one, uint32_t other)
{
    return one < other ? one : other;
}

/* Address of the first copy of a record. */
static uint32_t first_copy(const records_t *records, uint32_t kind)
{
    return records->flash->records_offset + kind * 2 * RECORD_COPY_BYTES;
}

/* Address of the other one of the two copies. */
static uint32_t other_copy(const records_t *records, uint32_t copy)
{
    uint32_t first = first_copy(records, records->kind);

    return copy == first ? first + RECORD_COPY_BYTES : first;
}

status_t records_init(records_t *records, flash_t *flash)
{
    *records = (records_t){0};
    if (flash->records_bytes < RECORD_KINDS * 2 * RECORD_COPY_BYTES) {
        return STATUS_UNSUPPORTED;
    }
    records->flash = flash;
    return STATUS_OK;
}

/* Whether the record of this kind can be accessed now. */
static status_t check_access(const records_t *records, uint32_t kind)
{
    if (records == NULL || kind >= RECORD_KINDS) {
        return STATUS_BAD_ARGUMENT;
    }
    if (records->flash == NULL) {
        return STATUS_UNSUPPORTED;
    }
    return records->step != RECORDS_IDLE ? STATUS_BUSY : STATUS_OK;
}

status_t records_read(const records_t *records, uint32_t kind, void *buffer, uint32_t room, uint32_t *size)
{
    status_t        status = check_access(records, kind);
    record_header_t header;
    uint32_t        copy;

    if (status != STATUS_OK) {
        return status;
    }
    if (size == NULL || (buffer == NULL && room > 0)) {
        return STATUS_BAD_ARGUMENT;
    }
    /* A flash that is busy, with an update for instance, reads as if it were erased. */
    if (flash_poll(records->flash, records->flash->began) != STATUS_OK) {
        return STATUS_BUSY;
    }
    copy = record_newest(first_copy(records, kind), kind, &header);
    if (copy == 0) {
        return STATUS_NO_RECORD;
    }
    *size = header.size;
    if (header.size > room) {
        return STATUS_LENGTH;
    }
    flash_read(copy + RECORD_DATA_OFFSET, buffer, header.size);
    return STATUS_OK;
}

/* Writing. */

/* Whether the newest copy already has the new bytes. */
static bool is_equal(const records_t *records, const record_header_t *header)
{
    uint8_t  page[PAGE];
    uint32_t length;

    if (header->size != records->size) {
        return false;
    }
    for (uint32_t position = 0; position < records->size; position += length) {
        length = smaller(records->size - position, PAGE);
        flash_read(records->newest + RECORD_DATA_OFFSET + position, page, length);
        if (memcmp(page, records->data + position, length) != 0) {
            return false;
        }
    }
    return true;
}

/* Finds the copy to write; STATUS_OK if nothing has to be written. */
static status_t survey(records_t *records)
{
    record_header_t header;

    records->newest = record_newest(first_copy(records, records->kind), records->kind, &header);
    if (records->erasing ? records->newest == 0 : records->newest != 0 && is_equal(records, &header)) {
        return STATUS_OK;
    }
    records->target   = records->newest != 0 ? other_copy(records, records->newest) : first_copy(records, records->kind);
    records->sequence = records->newest != 0 ? header.sequence + 1 : 0;
    records->step     = RECORDS_ERASE;
    return STATUS_BUSY;
}

/* Erases the next sector, that of the header first: data without a header is no record. */
static status_t erase(records_t *records, uint64_t clock)
{
    uint32_t bytes  = records->erasing ? SECTOR : RECORD_DATA_OFFSET + records->size;
    status_t status = flash_begin_erase(records->flash, records->target + records->position, clock);

    records->position += SECTOR;
    if (records->position < bytes) {
        return status;
    }
    records->position = 0;
    if (!records->erasing) {
        records->step = records->size > 0 ? RECORDS_PROGRAM : RECORDS_HEADER;
    } else if (records->target != records->newest) {
        /* The older copy is erased: now the newest one may be. */
        records->target = records->newest;
    } else {
        records->step = RECORDS_CHECK;
    }
    return status;
}

static status_t program(records_t *records, uint64_t clock)
{
    uint32_t address = records->target + RECORD_DATA_OFFSET + records->position;
    uint32_t length  = smaller(records->size - records->position, PAGE);
    status_t status  = flash_begin_program(records->flash, address, records->data + records->position, length, clock);

    records->position += length;
    if (records->position == records->size) {
        records->step = RECORDS_HEADER;
    }
    return status;
}

static status_t program_header(records_t *records, uint64_t clock)
{
    record_header_t header = {.magic = RECORD_MAGIC, .kind = records->kind, .sequence = records->sequence,
        .size = records->size};

    header.crc32  = crc32_update(record_header_crc(&header), records->data, records->size);
    records->step = RECORDS_CHECK;
    return flash_begin_program(records->flash, records->target, (const uint8_t *)&header, sizeof(header), clock);
}

/* Reads back what has been written. */
static status_t check(records_t *records)
{
    record_header_t header;

    records->newest = record_newest(first_copy(records, records->kind), records->kind, &header);
    if (records->erasing ? records->newest == 0 : records->newest == records->target && is_equal(records, &header)) {
        return STATUS_OK;
    }
    return flash_is_protected(records->flash) ? STATUS_PROTECTED : STATUS_CRC;
}

/* Does the next step, with the flash ready; STATUS_BUSY unless that ends the write. */
static status_t advance(records_t *records, uint64_t clock)
{
    status_t status;

    switch (records->step) {
    case RECORDS_SURVEY:
        return survey(records);
    case RECORDS_ERASE:
        status = erase(records, clock);
        break;
    case RECORDS_PROGRAM:
        status = program(records, clock);
        break;
    case RECORDS_HEADER:
        status = program_header(records, clock);
        break;
    default:
        return check(records);
    }
    return status == STATUS_OK ? STATUS_BUSY : status;
}

status_t records_poll(records_t *records, uint64_t clock)
{
    status_t status;

    if (records->step == RECORDS_IDLE) {
        return STATUS_IDLE;
    }
    status = flash_poll(records->flash, clock);
    if (status == STATUS_OK) {
        status = advance(records, clock);
    }
    if (status != STATUS_BUSY) {
        records->step = RECORDS_IDLE;
    }
    return status;
}

static void begin(records_t *records, uint32_t kind, const void *data, uint32_t size, bool erasing)
{
    *records = (records_t){.flash = records->flash, .step = RECORDS_SURVEY, .erasing = erasing, .kind = kind,
        .data = data, .size = size};
}

status_t records_begin_write(records_t *records, uint32_t kind, const void *data, uint32_t size)
{
    status_t status = check_access(records, kind);

    if (status == STATUS_OK && data == NULL && size > 0) {
        status = STATUS_BAD_ARGUMENT;
    }
    if (status == STATUS_OK && size > RECORD_MOST_BYTES) {
        status = STATUS_LENGTH;
    }
    if (status == STATUS_OK) {
        begin(records, kind, data, size, false);
    }
    return status;
}

/* Polls a write to its end. There are at most 5 erases and 80 programs, and each of them is bounded by flash_poll. */
static status_t finish(records_t *records)
{
    status_t status;

    do {
        status = records_poll(records, clock_now());
        watchdog_feed();
    } while (status == STATUS_BUSY);
    return status;
}

status_t records_write(records_t *records, uint32_t kind, const void *data, uint32_t size)
{
    status_t status = records_begin_write(records, kind, data, size);

    return status == STATUS_OK ? finish(records) : status;
}

status_t records_erase(records_t *records, uint32_t kind)
{
    status_t status = check_access(records, kind);

    if (status != STATUS_OK) {
        return status;
    }
    begin(records, kind, NULL, 0, true);
    return finish(records);
}
