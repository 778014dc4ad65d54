/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Updates of the firmware in flash: good ones, refusals, faults of the flash, and power failures at each moment. The
 * choice of the boot program always finds a good image; before the end of an update it is the old one. */

#include "link/update/update.h"

#include <stddef.h>
#include <string.h>

#include "boot/image.h"
#include "boot/start.h"
#include "drivers/reset_word.h"
#include "drivers/trial_choice.h"
#include "fake_flash.h"
#include "generated/csr.h"
#include "generated/soc.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"
#include "litestereo/platform.h"
#include "require.h"

#define SLOT(number) (FIRST + (number) * ROOM)
#define FIRST        0x100000u
#define ROOM         0x40000u
#define HZ           1000000u
#define LENGTH       5000u  /* Of the new firmware: two sectors, 20 pages, the last ones in part. */
#define OLD_LENGTH   5500u
#define RECORD       3u     /* Operations to write a record. */
#define OPERATIONS   (RECORD + 2 + 20 + RECORD)
#define CHUNK        1024u

static flash_t   flash;
static records_t records;
static trial_t   trial;
static update_t  update;
static _Alignas(8) uint8_t memory[ROOM];
static uint8_t  old[OLD_LENGTH], new[LENGTH];
static uint64_t now;

static uint32_t reset_word;  /* The register reset_record_cause. */

uint32_t reset_record_cause_read(void)           { return reset_word; }
void     reset_record_cause_write(uint32_t word) { reset_word = word; }
void     reset_forget_starts(void)               { reset_word = 0; }
uint64_t clock_now(void)                         { return now += 1000; }

static void fill(uint8_t *firmware, uint32_t length, unsigned seed)
{
    for (uint32_t i = 0; i < length; i++) {
        firmware[i] = (uint8_t)next_random(&seed);
    }
    memcpy(firmware + length - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
    firmware[length - sizeof(firmware_tag) + offsetof(firmware_tag_t, flags)] = FIRMWARE_TAG_CONFIRMS;
}

/* The start of a firmware from an image, 1 for the first, or from elsewhere, 0. */
static void prepare(uint8_t image)
{
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK && records_init(&records, &flash) == STATUS_OK);
    trial_init(&trial, &records, &(reset_report_t){.image = image}, HZ);
    update_init(&update, &flash, &trial, memory);
}

/* A device whose flash has good images, a bit per image. */
static void set_up(unsigned good)
{
    fake_flash_reset();
    fill(old, OLD_LENGTH, 1);
    old[OLD_LENGTH - sizeof(firmware_tag) + offsetof(firmware_tag_t, flags)] = 0;
    fill(new, LENGTH, 2);
    for (unsigned slot = 0; slot < 2; slot++) {
        fake_flash_put_image(SLOT(slot), old, OLD_LENGTH);
        if ((good >> slot & 1) == 0) {
            fake_flash.contents[SLOT(slot) + 100] ^= 1;
        }
    }
    prepare(0);
}

static void load(const uint8_t *firmware, uint32_t length)
{
    REQUIRE(update_begin(&update, length, crc32_update(0, firmware, length)) == STATUS_OK);
    for (uint32_t offset = 0; offset < length; offset += CHUNK) {
        uint32_t rest = length - offset < CHUNK ? length - offset : CHUNK;

        REQUIRE(update_store(&update, offset, firmware + offset, rest) == STATUS_OK);
    }
}

/* What is erased, programmed or read back is progress at once: a host gives up a device whose progress stops. */
static void require_progress(const update_t *before)
{
    uint32_t size   = before->total / 3;
    bool     counts = before->step == UPDATE_ERASE || before->step == UPDATE_PROGRAM || before->step == UPDATE_READ_BACK;

    REQUIRE(update.done >= before->done && update.done <= update.total);
    if (update.state != UPDATE_WRITING) {
        return;
    }
    if (counts && update.step == before->step) {
        REQUIRE(update.done - before->done == update.position - before->position);
    }
    if (counts && update.step != before->step) {
        REQUIRE(update.done == (before->step == UPDATE_ERASE ? size : before->step == UPDATE_PROGRAM ? 2 * size : 3 * size));
    }
}

/* Polls until the update has ended, or the power has failed. */
static void work(void)
{
    REQUIRE(update_write(&update) == STATUS_OK);
    for (int polls = 0; update_is_running(&update) && !fake_flash.dead; polls++) {
        update_t before = update;

        REQUIRE(polls < 100000);
        trial_poll(&trial, now += 1000);
        update_poll(&update, now);
        require_progress(&before);
    }
}

/* The firmware that the boot program starts: 'o' for the old, 'n' for the new, 't' for the new on trial, '-' for none. */
static char boot(void)
{
    static uint8_t started[ROOM];
    trial_record_t record;
    uint32_t       image;

    reset_word = 0;
    image      = start_load(started);
    if (image == FLASH_IMAGES) {
        return '-';
    }
    REQUIRE(reset_image(reset_word) == image + 1);
    if (reset_starts(reset_word) > 0) {
        REQUIRE(trial_read(&record) && record.state == TRIAL_RUNNING && record.image == image);
    }
    if (memcmp(started, new, LENGTH) == 0) {
        return reset_starts(reset_word) > 0 ? 't' : 'n';
    }
    REQUIRE(memcmp(started, old, OLD_LENGTH) == 0 && reset_starts(reset_word) == 0);
    return 'o';
}

static bool holds(unsigned slot, const uint8_t *firmware, uint32_t length)
{
    static uint8_t read[ROOM];

    return image_load(SLOT(slot), read, ROOM - 8) == length && memcmp(read, firmware, length) == 0;
}

static void require_failed(update_failure_t failure)
{
    if (update.state != UPDATE_FAILED || update.failure != failure) {
        fprintf(stderr, "state %d, failure %d\n", (int)update.state, (int)update.failure);
    }
    REQUIRE(update.state == UPDATE_FAILED && update.failure == failure);
}

static void test_good(void)
{
    for (unsigned good = 0; good < 4; good++) {
        for (uint8_t running = 0; running < 3; running++) {
            /* The image that runs is kept, unless the other one alone is good. */
            unsigned kept = running == 2 ? (good & 2) != 0 : (good & 1) == 0;
            unsigned slot = 1 - kept;

            set_up(good);
            prepare(running);
            load(new, LENGTH);
            work();
            REQUIRE(update.state == UPDATE_DONE && update.done == update.total && update.failure == 0);
            REQUIRE(holds(slot, new, LENGTH) && !holds(kept, new, LENGTH));
            REQUIRE(holds(kept, old, OLD_LENGTH) == (good >> kept & 1));
            REQUIRE(fake_flash.operations == (good == 0 ? OPERATIONS - RECORD : OPERATIONS));
            REQUIRE(trial_state(&trial) == TRIAL_RUNNING && boot() == 't');
            /* The sectors after the image, and everything outside of images and records, are unchanged. */
            for (uint32_t i = 0; i < FAKE_FLASH_BYTES; i++) {
                if (i < FIRST || i >= FIRST + 2 * ROOM + 2 * RECORD_COPY_BYTES
                    || (i < FIRST + 2 * ROOM && (i - FIRST) % ROOM >= 2 * 4096)) {
                    REQUIRE(fake_flash.contents[i] == 0xff);
                }
            }
            /* Repeating it does nothing. */
            REQUIRE(update_begin(&update, LENGTH, update.crc32) == STATUS_OK && update.state == UPDATE_DONE);
            REQUIRE(update_write(&update) == STATUS_OK && update.state == UPDATE_DONE);
            /* The next update does not keep what has not been tried, unless nothing else is good. */
            update_forget(&update);
            new[0] ^= 1;
            load(new, LENGTH);
            work();
            REQUIRE(update.state == UPDATE_DONE && holds(good == 0 ? kept : slot, new, LENGTH));
        }
    }
}

/* A firmware that would not confirm itself is started without a trial, and then is the one to keep. */
static void test_without_trial(void)
{
    set_up(3);
    new[LENGTH - sizeof(firmware_tag) + offsetof(firmware_tag_t, flags)] = 0;
    load(new, LENGTH);
    work();
    REQUIRE(update.state == UPDATE_DONE && trial_state(&trial) == TRIAL_CONFIRMED && boot() == 'n');
    REQUIRE(holds(0, old, OLD_LENGTH) && holds(1, new, LENGTH));
    prepare((uint8_t)reset_image(reset_word));
    load(old, OLD_LENGTH);
    work();
    REQUIRE(update.state == UPDATE_DONE && holds(0, old, OLD_LENGTH) && holds(1, new, LENGTH) && boot() == 'o');
}

/* Firmwares of all lengths near the size of a page, a sector and an image. */
static void test_lengths(void)
{
    static const uint32_t lengths[] = {32, 33, 247, 248, 249, 503, 504, 505, 1024, 4087, 4088, 4089, 4343, 4344, 4345,
        ROOM - 8};
    static uint8_t firmware[ROOM];

    for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
        set_up(1);
        fill(firmware, lengths[i], 3);
        load(firmware, lengths[i]);
        work();
        REQUIRE(update.state == UPDATE_DONE && update.done == update.total);
        REQUIRE(holds(0, old, OLD_LENGTH) && holds(1, firmware, lengths[i]));
    }
}

static void test_refused(void)
{
    uint32_t crc;

    set_up(3);
    crc = crc32_update(0, new, LENGTH);
    REQUIRE(update_room(&update) == ROOM - 8);
    REQUIRE(update_write(&update) == STATUS_STATE && update_store(&update, 0, new, CHUNK) == STATUS_STATE);
    REQUIRE(update_begin(&update, 0, crc) == STATUS_SIZE && update_begin(&update, ROOM - 7, crc) == STATUS_SIZE);
    REQUIRE(update_begin(&update, 0xffffffff, crc) == STATUS_SIZE && update.state == UPDATE_EMPTY);
    load(new, LENGTH);
    REQUIRE(update_store(&update, 1, new, CHUNK) == STATUS_OFFSET);
    REQUIRE(update_store(&update, 5 * CHUNK, new, CHUNK) == STATUS_OFFSET);
    REQUIRE(update_store(&update, 0xfffffc00, new, CHUNK) == STATUS_OFFSET);
    REQUIRE(update_store(&update, 0, new, CHUNK - 1) == STATUS_LENGTH);
    REQUIRE(update_store(&update, 4 * CHUNK, new, CHUNK) == STATUS_LENGTH);
    REQUIRE(update_chunk_length(&update, 4 * CHUNK) == LENGTH - 4 * CHUNK);
    /* While it is being written it can be neither changed nor forgotten. */
    REQUIRE(update_write(&update) == STATUS_OK && update.state == UPDATE_CHECKING);
    REQUIRE(update_store(&update, 0, old, CHUNK) == STATUS_STATE && update_begin(&update, 5, 5) == STATUS_STATE);
    update_forget(&update);
    REQUIRE(update.state == UPDATE_CHECKING && update_begin(&update, LENGTH, crc) == STATUS_OK);
    work();
    REQUIRE(update.state == UPDATE_DONE && boot() == 't');
    update_forget(&update);
    REQUIRE(update.state == UPDATE_EMPTY);
}

/* Anything but a complete firmware for this SoC does not touch the flash. */
static void test_unfit(void)
{
    static const uint32_t places[] = {0, 4, 16};  /* Magic, SoC, name. */

    set_up(3);
    load(new, LENGTH);
    memory[3000] ^= 1;
    work();
    require_failed(UPDATE_CHECKSUM);
    /* After a failure the same firmware may be announced again. */
    load(new, LENGTH);
    REQUIRE(update.state == UPDATE_LOADING && update.failure == UPDATE_NO_FAILURE);
    for (unsigned i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
        fill(new, LENGTH, 2);
        new[LENGTH - sizeof(firmware_tag) + places[i]] ^= 1;
        load(new, LENGTH);
        work();
        require_failed(UPDATE_FOREIGN);
    }
    load(new, sizeof(firmware_tag) - 1);
    work();
    require_failed(UPDATE_FOREIGN);
    REQUIRE(fake_flash.operations == 0 && boot() == 'o');
    /* Another version is accepted. */
    fill(new, LENGTH, 2);
    new[LENGTH - sizeof(firmware_tag) + 8] ^= 1;
    load(new, LENGTH);
    work();
    REQUIRE(update.state == UPDATE_DONE && boot() == 't');
}

static void test_faults(void)
{
    set_up(3);
    fake_flash.locked = true;
    load(new, LENGTH);
    work();
    require_failed(UPDATE_PROTECTED);
    set_up(3);
    fake_flash.protect = true;
    load(new, LENGTH);
    work();
    require_failed(UPDATE_PROTECTED);
    REQUIRE(boot() == 'o');
    set_up(3);
    fake_flash.worn = SLOT(1) + 4000;
    load(new, LENGTH);
    work();
    require_failed(UPDATE_VERIFY);
    REQUIRE(boot() == 'o' && holds(0, old, OLD_LENGTH));
    set_up(3);
    fake_flash.stuck = true;
    load(new, LENGTH);
    work();
    require_failed(UPDATE_TIMEOUT);
    /* A busy flash reads as if it had no good image: the next attempt must wait for it. */
    load(new, LENGTH);
    REQUIRE(update_write(&update) == STATUS_OK);
    while (update.state == UPDATE_CHECKING) {
        update_poll(&update, now += 1000);
    }
    for (int round = 0; round < 2; round++) {
        trial_poll(&trial, now);
        update_poll(&update, now += 1000);
    }
    fake_flash.stuck = false;
    while (flash_poll(&flash, flash.began) == STATUS_BUSY) {
    }
    work();
    require_failed(UPDATE_TIMEOUT);
    REQUIRE(fake_flash.operations == 1 && boot() == 'o');
    load(new, LENGTH);
    work();
    REQUIRE(update.state == UPDATE_DONE && boot() == 't');
}

/* An update whose power fails in operation `cut`, 1 for the first; returns whether it got that far. */
static bool update_cut(unsigned cut, enum fake_flash_cut part)
{
    REQUIRE(boot() != '-');
    prepare((uint8_t)reset_image(reset_word));
    fake_flash.operations_to_cut = cut;
    fake_flash.cut             = part;
    load(new, LENGTH);
    work();
    if (!fake_flash.dead) {
        REQUIRE(update.state == UPDATE_DONE);
        return false;
    }
    fake_flash_power_up();
    return true;
}

/* The power fails at each moment of an update, and then again in the next update. Before the last record is written the
 * old firmware is started. */
static void test_power(void)
{
    unsigned moments = 0, random = 5;

    for (unsigned good = 1; good < 4; good++) {
        for (unsigned cut = 1; cut <= OPERATIONS + 1; cut++) {
            for (int part = CUT_BEFORE; part <= CUT_AFTER; part++) {
                char next;

                set_up(good);
                fake_flash.random = next_random(&random);
                if (!update_cut(cut, (enum fake_flash_cut)part)) {
                    break;
                }
                moments++;
                next = boot();
                REQUIRE(next == 'o' || (next == 't' && cut == OPERATIONS && part != CUT_BEFORE));
                REQUIRE(next == 't' || cut < OPERATIONS || part != CUT_AFTER);
                /* The firmware that has been started, and confirmed or not, updates again. */
                update_cut(next_random(&random) % OPERATIONS + 1, (enum fake_flash_cut)(next_random(&random) % 3));
                REQUIRE(boot() != '-');
                REQUIRE(!update_cut(0, CUT_BEFORE) && boot() == 't');
            }
        }
    }
    REQUIRE(moments == 3 * 3 * OPERATIONS);
}

int main(void)
{
    test_good();
    test_without_trial();
    test_lengths();
    test_refused();
    test_unfit();
    test_faults();
    test_power();
    return 0;
}
