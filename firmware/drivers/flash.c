/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/flash.h"

#include <string.h>

#include "flash_pins.h"

/* Whether the SoC has a flash, and constants that say where its images are. */
#define HAS_FLASH (FLASH_IMAGES > 0)

enum {
    COMMAND_PROGRAM      = 0x02,
    COMMAND_WRITE_ENABLE = 0x06,
    COMMAND_ERASE_SECTOR = 0x20,
    COMMAND_ID           = 0x9f,
};

/* Other bits of the status register: write enable latch, protected blocks. */
enum { STATUS_BIT_ENABLED = 0x02, STATUS_BITS_PROTECTED = 0x1c };

/* Seconds that an operation may take. Data sheets of most devices say 0.4 and 0.003. */
enum { ERASE_LIMIT_S = 5, PROGRAM_LIMIT_S = 1 };

/* Plausible capacities in the JEDEC id, as powers of two in bytes. */
enum { LEAST_CAPACITY = 18, MOST_CAPACITY = 31 };

static uint32_t read_id(void)
{
    uint8_t  nothing;
    uint32_t id;

    /* The FPGA may swallow the first clocks: flash_read makes some before it selects the flash. */
    flash_read(0, &nothing, 0);
    flash_transfer(COMMAND_ID);
    id = (uint32_t)flash_transfer(0) << 16;
    id |= (uint32_t)flash_transfer(0) << 8;
    id |= flash_transfer(0);
    flash_deselect();
    return id;
}

status_t flash_init(flash_t *flash, uint32_t clock_hz)
{
    uint32_t maker, capacity;

    memset(flash, 0, sizeof(*flash));
    flash->clock_hz = clock_hz;
    if (!HAS_FLASH) {
        return STATUS_UNSUPPORTED;
    }
    flash->images         = FLASH_IMAGES;
    flash->images_offset  = FLASH_IMAGES_OFFSET;
    flash->image_bytes    = FLASH_IMAGE_BYTES;
    flash->records_offset = FLASH_RECORDS_OFFSET;
    flash->records_bytes  = FLASH_RECORDS_BYTES;
    flash->id             = read_id();
    maker                 = flash->id >> 16;
    capacity              = flash->id & 0xff;
    if (maker == 0 || maker == 0xff || capacity < LEAST_CAPACITY || capacity > MOST_CAPACITY
        || flash->images_offset + flash->images * flash->image_bytes > 1u << capacity
        || flash->records_offset + flash->records_bytes > 1u << capacity) {
        return STATUS_UNSUPPORTED;
    }
    return STATUS_OK;
}

/* Whether these bytes are within the `size` bytes from `offset` on. */
static bool is_within(uint32_t address, uint32_t length, uint32_t offset, uint32_t size)
{
    uint32_t inside = address - offset;

    return address >= offset && inside < size && length <= size - inside;
}

/* Whether these bytes are within the images or the records, and within one page or sector of `piece` bytes, a power of
 * two. */
static bool is_writable(const flash_t *flash, uint32_t address, uint32_t length, uint32_t piece)
{
    return length > 0 && address % piece + length <= piece
        && (is_within(address, length, flash->images_offset, flash->images * flash->image_bytes)
            || is_within(address, length, flash->records_offset, flash->records_bytes));
}

/* Enables writing and sends a command with its address; leaves the flash selected. */
static status_t begin(flash_t *flash, uint8_t command, uint32_t address, uint64_t clock, uint32_t limit_s)
{
    if ((flash_read_status() & STATUS_BIT_BUSY) != 0) {
        return STATUS_BUSY;
    }
    flash_transfer(COMMAND_WRITE_ENABLE);
    flash_deselect();
    if ((flash_read_status() & STATUS_BIT_ENABLED) == 0) {
        return STATUS_PROTECTED;
    }
    flash->began = clock;
    flash->limit = (uint64_t)limit_s * flash->clock_hz;
    flash_transfer(command);
    flash_transfer((uint8_t)(address >> 16));
    flash_transfer((uint8_t)(address >> 8));
    flash_transfer((uint8_t)address);
    return STATUS_OK;
}

status_t flash_begin_erase(flash_t *flash, uint32_t address, uint64_t clock)
{
    status_t status;

    if (!HAS_FLASH) {
        return STATUS_UNSUPPORTED;
    }
    if (!is_writable(flash, address, FLASH_SECTOR_BYTES, FLASH_SECTOR_BYTES)) {
        return STATUS_BAD_ARGUMENT;
    }
    status = begin(flash, COMMAND_ERASE_SECTOR, address, clock, ERASE_LIMIT_S);
    if (status == STATUS_OK) {
        flash_deselect();
    }
    return status;
}

status_t flash_begin_program(flash_t *flash, uint32_t address, const uint8_t *data, uint32_t length, uint64_t clock)
{
    status_t status;

    if (!HAS_FLASH) {
        return STATUS_UNSUPPORTED;
    }
    if (!is_writable(flash, address, length, FLASH_PAGE_BYTES)) {
        return STATUS_BAD_ARGUMENT;
    }
    status = begin(flash, COMMAND_PROGRAM, address, clock, PROGRAM_LIMIT_S);
    if (status == STATUS_OK) {
        while (length-- > 0) {
            flash_transfer(*data++);
        }
        flash_deselect();
    }
    return status;
}

status_t flash_poll(const flash_t *flash, uint64_t clock)
{
    if (!HAS_FLASH) {
        return STATUS_UNSUPPORTED;
    }
    if ((flash_read_status() & STATUS_BIT_BUSY) == 0) {
        return STATUS_OK;
    }
    return clock - flash->began > flash->limit ? STATUS_TIMEOUT : STATUS_BUSY;
}

bool flash_is_protected(const flash_t *flash)
{
    (void)flash;
    return HAS_FLASH && (flash_read_status() & STATUS_BITS_PROTECTED) != 0;
}
