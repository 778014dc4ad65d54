/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Updates of the firmware in flash: a good one, refusals, faults of the flash, and power failures
 * at each moment. The real boot program always finds a good image. */

#include "link/update/update.h"

#include <string.h>

#include "boot/image.h"
#include "fake_flash.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"
#include "require.h"

#define SLOT(number) (FIRST + (number) * ROOM)
#define FIRST        0x100000u
#define ROOM         0x40000u
#define HZ           1000000u
#define LENGTH       5000u  /* Of the new firmware: two sectors, 20 pages, the last ones in part. */
#define OLD_LENGTH   5500u
#define OPERATIONS   (2 * (2 + 20))
#define CHUNK        1024u

static flash_t  flash;
static update_t update;
static _Alignas(8) uint8_t memory[ROOM];
static uint8_t  old[OLD_LENGTH], new[LENGTH];
static uint64_t now;

static void fill(uint8_t *firmware, uint32_t length, unsigned seed)
{
    for (uint32_t i = 0; i < length; i++) {
        firmware[i] = (uint8_t)next_random(&seed);
    }
    memcpy(firmware + length - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
}

/* A device whose flash has good images, a bit per image. */
static void set_up(unsigned good)
{
    fake_flash_reset();
    fill(old, OLD_LENGTH, 1);
    fill(new, LENGTH, 2);
    for (unsigned slot = 0; slot < 2; slot++) {
        fake_flash_put_image(SLOT(slot), old, OLD_LENGTH);
        if ((good >> slot & 1) == 0) {
            fake_flash.contents[SLOT(slot) + 100] ^= 1;
        }
    }
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    update_init(&update, &flash, memory);
}

static void load(const uint8_t *firmware, uint32_t length)
{
    REQUIRE(update_begin(&update, length, crc32_update(0, firmware, length)) == STATUS_OK);
    for (uint32_t offset = 0; offset < length; offset += CHUNK) {
        uint32_t rest = length - offset < CHUNK ? length - offset : CHUNK;

        REQUIRE(update_store(&update, offset, firmware + offset, rest) == STATUS_OK);
    }
}

/* Polls until the update has ended, or the power has failed. */
static void work(void)
{
    REQUIRE(update_write(&update) == STATUS_OK);
    for (int polls = 0; update_is_running(&update) && !fake_flash.dead; polls++) {
        uint32_t done = update.done;

        REQUIRE(polls < 100000);
        update_poll(&update, now += 1000);
        REQUIRE(update.done >= done && update.done <= update.total);
    }
}

/* The firmware that the boot program starts: 'o' for the old, 'n' for the new, '-' for none. */
static char boot(void)
{
    static uint8_t started[ROOM];

    for (unsigned slot = 0; slot < 2; slot++) {
        uint32_t length = image_load(SLOT(slot), started, ROOM - 8);

        if (length > 0) {
            bool is_new = length == LENGTH && memcmp(started, new, LENGTH) == 0;

            REQUIRE(is_new || (length == OLD_LENGTH && memcmp(started, old, OLD_LENGTH) == 0));
            return is_new ? 'n' : 'o';
        }
    }
    return '-';
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
        set_up(good);
        load(new, LENGTH);
        work();
        REQUIRE(update.state == UPDATE_DONE && update.done == update.total && update.failure == 0);
        REQUIRE(holds(0, new, LENGTH) && holds(1, new, LENGTH) && boot() == 'n');
        REQUIRE(fake_flash.operations == OPERATIONS);
        /* The sectors after an image, and everything outside of the images, are unchanged. */
        for (uint32_t i = 0; i < FAKE_FLASH_BYTES; i++) {
            if (i < FIRST || i >= FIRST + 2 * ROOM || (i - FIRST) % ROOM >= 2 * 4096) {
                REQUIRE(fake_flash.contents[i] == 0xff);
            }
        }
        /* Repeating it does nothing. */
        REQUIRE(update_begin(&update, LENGTH, update.crc32) == STATUS_OK && update.state == UPDATE_DONE);
        REQUIRE(update_write(&update) == STATUS_OK && update.state == UPDATE_DONE);
    }
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
        REQUIRE(holds(0, firmware, lengths[i]) && holds(1, firmware, lengths[i]));
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
    REQUIRE(update.state == UPDATE_DONE && boot() == 'n');
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
    REQUIRE(update.state == UPDATE_DONE && boot() == 'n');
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
    REQUIRE(update.state == UPDATE_DONE && boot() == 'n');
}

/* An update whose power fails in operation `cut`, 1 for the first; returns whether it got that far. */
static bool update_cut(unsigned cut, enum fake_flash_cut part)
{
    fake_flash.operations_to_cut = cut;
    fake_flash.cut             = part;
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    update_init(&update, &flash, memory);
    load(new, LENGTH);
    work();
    if (!fake_flash.dead) {
        REQUIRE(update.state == UPDATE_DONE);
        return false;
    }
    fake_flash_power_up();
    return true;
}

/* The power fails at each moment of an update, and then again in the next update. */
static void test_power(void)
{
    unsigned moments = 0, random = 5;

    for (unsigned good = 1; good < 4; good++) {
        for (unsigned cut = 1; cut <= OPERATIONS + 1; cut++) {
            for (int part = CUT_BEFORE; part <= CUT_AFTER; part++) {
                set_up(good);
                fake_flash.random = next_random(&random);
                if (!update_cut(cut, (enum fake_flash_cut)part)) {
                    break;
                }
                moments++;
                REQUIRE(boot() != '-');
                update_cut(next_random(&random) % OPERATIONS + 1, (enum fake_flash_cut)(next_random(&random) % 3));
                REQUIRE(boot() != '-');
                REQUIRE(!update_cut(0, CUT_BEFORE) && boot() == 'n');
                REQUIRE(holds(0, new, LENGTH) && holds(1, new, LENGTH));
            }
        }
    }
    REQUIRE(moments == 3 * 3 * OPERATIONS);
}

int main(void)
{
    test_good();
    test_lengths();
    test_refused();
    test_unfit();
    test_faults();
    test_power();
    return 0;
}
