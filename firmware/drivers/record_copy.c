/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reading the copies of a record, apart from records.c because the boot program has no room for more. */

#include "record_copy.h"

#include <stddef.h>

#include "litestereo/crc32.h"

_Static_assert(sizeof(record_header_t) == 20, "the layout in flash");
_Static_assert(sizeof(record_header_t) <= RECORD_DATA_OFFSET, "the header fits its page");

uint32_t record_header_crc(const record_header_t *header)
{
    return crc32_update(0, header, offsetof(record_header_t, crc32));
}

bool record_copy_check(uint32_t address, uint32_t kind, record_header_t *header)
{
    uint8_t  page[FLASH_PAGE_BYTES];
    uint32_t crc, length;

    flash_read(address, header, sizeof(*header));
    if (header->magic != RECORD_MAGIC || header->kind != kind || header->size > RECORD_MOST_BYTES) {
        return false;
    }
    crc = record_header_crc(header);
    for (uint32_t position = 0; position < header->size; position += length) {
        length = header->size - position < sizeof(page) ? header->size - position : (uint32_t)sizeof(page);
        flash_read(address + RECORD_DATA_OFFSET + position, page, length);
        crc = crc32_update(crc, page, length);
    }
    return crc == header->crc32;
}

uint32_t record_newest(uint32_t address, uint32_t kind, record_header_t *header)
{
    record_header_t second;
    bool            has_first  = record_copy_check(address, kind, header);
    bool            has_second = record_copy_check(address + RECORD_COPY_BYTES, kind, &second);

    /* Sequence numbers wrap around. Two copies with the same one are not written by records.c: either would do. */
    if (has_second && (!has_first || (int32_t)(second.sequence - header->sequence) > 0)) {
        *header = second;
        return address + RECORD_COPY_BYTES;
    }
    return has_first ? address : 0;
}
