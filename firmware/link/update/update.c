/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "update.h"

#include <string.h>

#include "lib/bytes.h"
#include "link/protocol/protocol.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"

/* Bytes of memory that one poll checks. */
#define BYTES_PER_CHECK 1024u

#define PAGE   FLASH_PAGE_BYTES
#define SECTOR FLASH_SECTOR_BYTES

static uint32_t smaller(uint32_t one, uint32_t other)
{
    return one < other ? one : other;
}

static uint32_t image_size(const update_t *update)
{
    return FLASH_HEADER_BYTES + update->length;
}

static uint32_t image_address(const update_t *update)
{
    return update->flash->images_offset + update->image_index * update->flash->image_bytes;
}

void update_init(update_t *update, flash_t *flash, trial_t *trial, uint8_t *memory)
{
    *update = (update_t){.flash = flash, .trial = trial, .image = memory};
}

uint32_t update_room(const update_t *update)
{
    return update->flash->image_bytes - FLASH_HEADER_BYTES;
}

trial_state_t update_trial(const update_t *update)
{
    return trial_state(update->trial);
}

bool update_is_running(const update_t *update)
{
    return update->state == UPDATE_CHECKING || update->state == UPDATE_WRITING;
}

/* Loading the firmware to memory. */

status_t update_begin(update_t *update, uint32_t length, uint32_t crc32)
{
    bool known = update->state != UPDATE_EMPTY && update->state != UPDATE_FAILED;

    if (known && update->length == length && update->crc32 == crc32) {
        return STATUS_OK;
    }
    if (update_is_running(update)) {
        return STATUS_STATE;
    }
    if (length == 0 || length > update_room(update)) {
        return STATUS_SIZE;
    }
    update_init(update, update->flash, update->trial, update->image);
    update->state  = UPDATE_LOADING;
    update->length = length;
    update->crc32  = crc32;
    update->total  = 3 * image_size(update);
    put_u32(update->image, length);
    put_u32(update->image + 4, crc32);
    return STATUS_OK;
}

uint32_t update_chunk_length(const update_t *update, uint32_t offset)
{
    if (offset % PROTOCOL_CHUNK_SIZE != 0 || offset >= update->length) {
        return 0;
    }
    return smaller(update->length - offset, PROTOCOL_CHUNK_SIZE);
}

status_t update_store(update_t *update, uint32_t offset, const uint8_t *chunk, uint32_t length)
{
    uint32_t expected = update_chunk_length(update, offset);

    if (update->state != UPDATE_LOADING) {
        return STATUS_STATE;
    }
    if (expected == 0) {
        return STATUS_OFFSET;
    }
    if (length != expected) {
        return STATUS_LENGTH;
    }
    copy_bytes(update->image + FLASH_HEADER_BYTES + offset, chunk, length);
    return STATUS_OK;
}

status_t update_write(update_t *update)
{
    if (update->state == UPDATE_EMPTY) {
        return STATUS_STATE;
    }
    if (update->state == UPDATE_LOADING) {
        update->state    = UPDATE_CHECKING;
        update->position = 0;
        update->found    = 0;
    }
    return STATUS_OK;
}

void update_forget(update_t *update)
{
    if (!update_is_running(update)) {
        update_init(update, update->flash, update->trial, update->image);
    }
}

static void fail(update_t *update, update_failure_t failure)
{
    update->state   = UPDATE_FAILED;
    update->failure = failure;
}

/* Checking the firmware in memory. */

static firmware_tag_t tag_of(const update_t *update)
{
    firmware_tag_t tag;

    memcpy(&tag, update->image + image_size(update) - sizeof(tag), sizeof(tag));
    return tag;
}

/* Whether the firmware's tag is that of this SoC; its version may differ. */
static bool is_for_this_soc(const update_t *update)
{
    firmware_tag_t tag;

    if (update->length < sizeof(tag)) {
        return false;
    }
    tag = tag_of(update);
    return memcmp(tag.magic, firmware_tag.magic, sizeof(tag.magic)) == 0 && tag.soc == firmware_tag.soc
        && memcmp(tag.name, firmware_tag.name, sizeof(tag.name)) == 0;
}

static void start_step(update_t *update, update_step_t step, uint32_t image_index)
{
    update->step        = step;
    update->image_index = image_index;
    update->position    = 0;
    update->asked       = false;
}

/* Index of the image to keep if it is good: the one that runs. An image that waits for its trial is replaced, even if the
 * running one is damaged. */
static uint32_t image_to_keep(const trial_t *trial, uint32_t images)
{
    if (trial_state(trial) == TRIAL_RUNNING && !trial->here) {
        return (trial->record.image + 1) % images;
    }
    return trial->started > 0 ? trial->started - 1 : 0;
}

static void check(update_t *update)
{
    uint32_t length = smaller(update->length - update->position, BYTES_PER_CHECK);

    update->found = crc32_update(update->found, update->image + FLASH_HEADER_BYTES + update->position, length);
    update->position += length;
    if (update->position < update->length) {
        return;
    }
    if (update->found != update->crc32) {
        fail(update, UPDATE_CHECKSUM);
    } else if (!is_for_this_soc(update)) {
        fail(update, UPDATE_FOREIGN);
    } else {
        update->state   = UPDATE_WRITING;
        /* The flash may still be busy from an earlier update, and cannot be read until it is ready. */
        update->waiting = true;
        start_step(update, UPDATE_SURVEY, image_to_keep(update->trial, update->flash->images));
    }
}

/* Writing the images in flash. */

/* Reads the next piece of an image; STATUS_BUSY until its end, then STATUS_OK if the boot program would start it. */
static status_t read_piece(update_t *update)
{
    uint32_t address = image_address(update);
    uint8_t  bytes[PAGE];
    uint32_t length;

    if (update->position == 0) {
        flash_read(address, bytes, FLASH_HEADER_BYTES);
        update->expected = get_u32(bytes);
        update->stored   = get_u32(bytes + 4);
        update->found    = 0;
        update->position = FLASH_HEADER_BYTES;
        return update->expected > 0 && update->expected <= update_room(update) ? STATUS_BUSY : STATUS_CRC;
    }
    length = smaller(FLASH_HEADER_BYTES + update->expected - update->position, PAGE);
    flash_read(address + update->position, bytes, length);
    update->found     = crc32_update(update->found, bytes, length);
    update->position += length;
    if (update->position < FLASH_HEADER_BYTES + update->expected) {
        return STATUS_BUSY;
    }
    return update->found == update->stored ? STATUS_OK : STATUS_CRC;
}

/* Finds the image to keep: the one that runs, or another one if that is damaged. The next one is written. If none is
 * good, it does not matter which one is written. */
static void survey(update_t *update)
{
    uint32_t next   = (update->image_index + 1) % update->flash->images;
    status_t status = read_piece(update);

    if (status == STATUS_BUSY) {
        return;
    }
    if (status == STATUS_OK) {
        start_step(update, UPDATE_KEEP, update->image_index);
    } else if (++update->surveyed < update->flash->images) {
        start_step(update, UPDATE_SURVEY, next);
    } else {
        start_step(update, UPDATE_ERASE, next);
    }
}

static void read_back(update_t *update)
{
    uint32_t before = update->position;
    status_t status = read_piece(update);

    update->done += update->position - before;
    if (status == STATUS_BUSY && update->expected == update->length && update->stored == update->crc32) {
        return;
    }
    if (status != STATUS_OK) {
        fail(update, flash_is_protected(update->flash) ? UPDATE_PROTECTED : UPDATE_VERIFY);
        return;
    }
    start_step(update, UPDATE_RECORD, update->image_index);
}

/* Has the trial's record written: before the image is written, that the other one is kept; after it, that the new
 * firmware is to be tried, or to be started without a trial if it would not confirm itself. */
static void write_record(update_t *update)
{
    bool     keeps    = update->step == UPDATE_KEEP;
    bool     confirms = !keeps && (tag_of(update).flags & FIRMWARE_TAG_CONFIRMS) != 0;
    status_t status   = trial_status(update->trial);

    if (status == STATUS_BUSY) {
        return;
    }
    if (!update->asked) {
        update->asked = true;
        status = trial_record(update->trial, confirms ? TRIAL_RUNNING : TRIAL_CONFIRMED, update->image_index,
            keeps ? update->stored : update->crc32);
        if (status == STATUS_OK) {
            return;
        }
    }
    if (status != STATUS_OK) {
        fail(update, status == STATUS_PROTECTED ? UPDATE_PROTECTED : status == STATUS_CRC ? UPDATE_VERIFY : UPDATE_TIMEOUT);
    } else if (keeps) {
        start_step(update, UPDATE_ERASE, (update->image_index + 1) % update->flash->images);
    } else {
        update->state = UPDATE_DONE;
        update->done  = update->total;
    }
}

/* Begins the next operation of a step; writes the number of bytes that it finishes to `length`. */
static status_t begin_next(update_t *update, uint64_t clock, uint32_t *length)
{
    uint32_t size = image_size(update);
    uint32_t page;

    if (update->step == UPDATE_ERASE) {
        *length = smaller(SECTOR, size - update->position);
        return flash_begin_erase(update->flash, image_address(update) + update->position, clock);
    }
    /* The first page is programmed last, when all others are finished. */
    page    = update->position + PAGE < size ? update->position + PAGE : 0;
    *length = page > 0 ? smaller(PAGE, size - page) : size - update->position;
    return flash_begin_program(update->flash, image_address(update) + page, update->image + page,
        smaller(PAGE, size - page), clock);
}

static void modify(update_t *update, uint64_t clock)
{
    uint32_t length = 0;
    status_t status = begin_next(update, clock, &length);

    if (status != STATUS_OK) {
        fail(update, status == STATUS_PROTECTED ? UPDATE_PROTECTED : UPDATE_TIMEOUT);
        return;
    }
    update->waiting   = true;
    update->position += length;
    update->done     += length;
}

/* Waits for the flash, without blocking; goes to the next step at the end of one. */
static void wait(update_t *update, uint64_t clock)
{
    status_t status = flash_poll(update->flash, clock);

    if (status == STATUS_BUSY) {
        return;
    }
    update->waiting = false;
    if (status != STATUS_OK) {
        fail(update, UPDATE_TIMEOUT);
    } else if (update->step != UPDATE_SURVEY && update->position == image_size(update)) {
        start_step(update, update->step == UPDATE_ERASE ? UPDATE_PROGRAM : UPDATE_READ_BACK, update->image_index);
    }
}

void update_poll(update_t *update, uint64_t clock)
{
    bool records = update->step == UPDATE_KEEP || update->step == UPDATE_RECORD;

    if (update->state == UPDATE_CHECKING) {
        check(update);
    } else if (update->state != UPDATE_WRITING) {
        return;
    } else if (records) {
        write_record(update);
    } else if (trial_status(update->trial) == STATUS_BUSY) {
        /* The flash does one operation at a time, and the trial has one to do. */
        return;
    } else if (update->waiting) {
        wait(update, clock);
    } else if (update->step == UPDATE_SURVEY) {
        survey(update);
    } else if (update->step == UPDATE_READ_BACK) {
        read_back(update);
    } else {
        modify(update, clock);
    }
}
