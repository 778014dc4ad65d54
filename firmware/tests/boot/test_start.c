/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The trial of a firmware, from update to update: the real boot program's choice, reset record, watchdog, trial, records
 * and update, with a flash in software. Firmwares that hang at once, crash after a second, let the watchdog expire, cannot
 * start, or are good. The power fails in each operation of the flash. */

#define WITH_WATCHDOG

#include "boot/start.c"
#include "drivers/reset.c"
#include "drivers/watchdog.c"

#include <setjmp.h>
#include <stddef.h>
#include <string.h>

#include "fake_flash.h"
#include "link/update/update.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"
#include "require.h"

#define HZ     CONFIG_CLOCK_FREQUENCY
#define LENGTH 600u
#define RUNS   0x00010100u  /* The watchdog is enabled, and resets. */
#define IMAGE(number) (FLASH_IMAGES_OFFSET + (number) * FLASH_IMAGE_BYTES)

/* Behaviour of a firmware, its first byte. */
enum { GOOD = 'g', HANGS = 'h', CRASHES = 'c', EXPIRES = 'w', FAILS = 'f' };
static const char bad[] = {HANGS, CRASHES, EXPIRES, FAILS};

/* The registers, and the target of a reset. */
static uint32_t cause, place, control, cycles;
static jmp_buf  after_reset;

static struct {
    flash_t        flash;
    records_t      records;
    trial_t        trial;
    update_t       update;
    reset_report_t report;
} firmware;

static uint8_t  memory[FLASH_IMAGE_BYTES];
static _Alignas(8) uint8_t update_memory[FLASH_IMAGE_BYTES];
static uint64_t now;

uint32_t reset_record_cause_read(void)              { return cause; }
uint32_t reset_record_place_read(void)              { return place; }
void     reset_record_cause_write(uint32_t value)   { cause = value; }
void     reset_record_place_write(uint32_t value)   { place = value; }
uint32_t watchdog0_control_read(void)               { return control; }
uint32_t watchdog0_cycles_read(void)                { return cycles; }
void     watchdog0_control_write(uint32_t value)    { control = value & RUNS; }
void     watchdog0_cycles_write(uint32_t value)     { cycles = value; }
void     watchdog0_ev_pending_write(uint32_t value) { (void)value; }
void     watchdog0_ev_enable_write(uint32_t value)  { (void)value; }
uint64_t clock_now(void)                            { return now += 1000; }

/* A reset clears all registers but those of the reset record. */
static void reset(void)
{
    control = cycles = 0;
    now     = 0;
}

void ctrl_reset_write(uint32_t value)
{
    (void)value;
    reset();
    longjmp(after_reset, 1);
}

static void power_up(void)
{
    fake_flash_power_up();
    reset();
    cause = place = 0;
}

static void make(uint8_t *bytes, char behaviour, uint8_t version)
{
    firmware_tag_t tag = firmware_tag;

    tag.flags = FIRMWARE_TAG_CONFIRMS;
    memset(bytes, version, LENGTH);
    bytes[0] = (uint8_t)behaviour;
    memcpy(bytes + LENGTH - sizeof(tag), &tag, sizeof(tag));
}

/* A device as `make flash` leaves it: version 1 in both images. */
static void set_up(void)
{
    uint8_t bytes[LENGTH];

    fake_flash_reset();
    power_up();
    make(bytes, GOOD, 1);
    fake_flash_put_image(IMAGE(0), bytes, LENGTH);
    fake_flash_put_image(IMAGE(1), bytes, LENGTH);
}

/* A round of the main loop, a hundredth of a second. */
static void round_of_loop(void)
{
    now += HZ / 100;
    trial_poll(&firmware.trial, now);
    update_poll(&firmware.update, now);
    watchdog_feed();
}

static void run(uint32_t hundredths)
{
    for (uint32_t i = 0; i < hundredths && !fake_flash.dead; i++) {
        round_of_loop();
    }
}

/* The start of a firmware up to its main loop. */
static void start(void)
{
    watchdog_start(HZ);
    reset_begin(&firmware.report);
    REQUIRE(flash_init(&firmware.flash, HZ) == STATUS_OK);
    REQUIRE(records_init(&firmware.records, &firmware.flash) == STATUS_OK);
    trial_init(&firmware.trial, &firmware.records, &firmware.report, HZ);
    update_init(&firmware.update, &firmware.flash, &firmware.trial, update_memory);
}

/* Boots, and runs the firmware to its reset or to its main loop. Returns its version if it works, 0 if it is reset. */
static uint8_t live(void)
{
    uint32_t starts = reset_starts(cause);
    uint32_t image  = start_load(memory);
    bool     guarded;
    trial_record_t record;

    REQUIRE(image < FLASH_IMAGES && reset_image(cause) == image + 1);
    guarded = control == RUNS && cycles == TRIAL_WATCHDOG_S * HZ;
    REQUIRE(guarded || (control == 0 && cycles == 0));
    /* Another program need not know of a watchdog: it is for starts on trial alone. */
    REQUIRE(guarded == (reset_starts(cause) > starts && trial_read(&record) && record.image == image));
    if (setjmp(after_reset) != 0) {
        return 0;
    }
    switch (memory[0]) {
    case HANGS:
        /* Without the boot program's watchdog it would hang for ever. */
        REQUIRE(guarded);
        reset();
        return 0;
    case FAILS:
        reset_begin(&firmware.report);
        reset_now(RESET_START, 0, 0);
        break;
    case CRASHES:
        start();
        run(100);
        reset_now(RESET_ENSURE, 0x40000000, 1);
        break;
    case EXPIRES:
        start();
        run(100);
        reset_now(RESET_WATCHDOG, 0x40000000, 0);
        break;
    default:
        start();
        break;
    }
    return memory[1];
}

/* Lives until a firmware works; returns its version, and the number of resets before in `failures`. */
static uint8_t settle(unsigned *failures)
{
    uint8_t version;

    for (*failures = 0; (version = live()) == 0; ++*failures) {
        REQUIRE(*failures < 20);
    }
    return version;
}

static void require_version(uint8_t version, unsigned failures)
{
    unsigned found_failures;
    uint8_t  found = settle(&found_failures);

    if (found != version || found_failures != failures) {
        fprintf(stderr, "version %u after %u failures\n", found, found_failures);
    }
    REQUIRE(found == version && found_failures == failures);
}

/* The running firmware takes an update; returns whether the power has not failed in it. */
static bool update(char behaviour, uint8_t version)
{
    update_t *one = &firmware.update;
    uint8_t   bytes[LENGTH];

    make(bytes, behaviour, version);
    REQUIRE(update_begin(one, LENGTH, crc32_update(0, bytes, LENGTH)) == STATUS_OK);
    REQUIRE(update_store(one, 0, bytes, LENGTH) == STATUS_OK && update_write(one) == STATUS_OK);
    for (unsigned rounds = 0; update_is_running(one) && !fake_flash.dead; rounds++) {
        REQUIRE(rounds < 10000);
        round_of_loop();
    }
    REQUIRE(fake_flash.dead || one->state == UPDATE_DONE);
    return !fake_flash.dead;
}

/* The running firmware restarts itself. */
static void restart(void)
{
    if (setjmp(after_reset) == 0) {
        reset_now(RESET_REQUESTED, 0, 0);
    }
}

/* A device that runs version 1 and has another firmware to try. */
static void set_up_trial(char behaviour)
{
    set_up();
    require_version(1, 0);
    REQUIRE(trial_state(&firmware.trial) == TRIAL_NONE && !trial_confirm(&firmware.trial));
    REQUIRE(update(behaviour, 2) && trial_state(&firmware.trial) == TRIAL_RUNNING);
    /* The old firmware cannot confirm the new one, by a minute of its loop or a session. */
    run(6100);
    REQUIRE(!trial_confirm(&firmware.trial) && trial_state(&firmware.trial) == TRIAL_RUNNING);
    restart();
}

/* After as many power cycles as wanted the device is in its final state. */
static void require_settled(uint8_t version, trial_state_t state)
{
    run(100);
    REQUIRE(trial_state(&firmware.trial) == state && trial_status(&firmware.trial) == STATUS_OK);
    REQUIRE(reset_starts(cause) == 0);
    for (int i = 0; i < 3; i++) {
        restart();
        require_version(version, 0);
        REQUIRE(firmware.report.cause == RESET_REQUESTED && trial_state(&firmware.trial) == state);
        /* Neither the trial's watchdog nor its count are on. */
        REQUIRE(reset_starts(cause) == 0 && cycles == HZ);
        power_up();
        require_version(version, 0);
        REQUIRE(firmware.report.cause == RESET_POWER_UP && trial_state(&firmware.trial) == state);
        run(6100);
        REQUIRE(trial_state(&firmware.trial) == state);
    }
}

static void test_good(void)
{
    /* Sixty seconds confirm it, and not less. */
    set_up_trial(GOOD);
    require_version(2, 0);
    REQUIRE(reset_starts(cause) == 1 && firmware.report.cause == RESET_REQUESTED);
    run(TRIAL_S * 100);
    REQUIRE(trial_state(&firmware.trial) == TRIAL_RUNNING);
    run(1);
    REQUIRE(trial_state(&firmware.trial) == TRIAL_CONFIRMED);
    require_settled(2, TRIAL_CONFIRMED);
    /* A session or the console confirms it at once. */
    set_up_trial(GOOD);
    require_version(2, 0);
    run(1);
    REQUIRE(trial_confirm(&firmware.trial) && !trial_confirm(&firmware.trial));
    require_settled(2, TRIAL_CONFIRMED);
    /* And the next update is tried in the same way, in the other image. */
    REQUIRE(update(GOOD, 3));
    restart();
    require_version(3, 0);
    REQUIRE(reset_image(cause) == 1 && trial_confirm(&firmware.trial));
    require_settled(3, TRIAL_CONFIRMED);
}

/* Three failed starts, exactly; then the old one is back, and says so. */
static void test_bad(void)
{
    for (size_t i = 0; i < sizeof(bad); i++) {
        set_up_trial(bad[i]);
        for (unsigned failed = 1; failed <= TRIAL_STARTS; failed++) {
            REQUIRE(live() == 0 && reset_image(cause) == 2 && reset_starts(cause) == failed);
        }
        REQUIRE(live() == 1 && reset_image(cause) == 1 && control == RUNS && cycles == HZ);
        REQUIRE(trial_state(&firmware.trial) == TRIAL_FELL_BACK);
        /* Before that is in flash, a reset does not bring the new one back. */
        reset();
        REQUIRE(live() == 1 && trial_state(&firmware.trial) == TRIAL_FELL_BACK);
        require_settled(1, TRIAL_FELL_BACK);
        /* The next update is tried with a new count; it replaces the bad one. */
        REQUIRE(update(bad[i], 3));
        restart();
        require_version(1, TRIAL_STARTS);
        run(100);
        REQUIRE(update(GOOD, 4));
        restart();
        require_version(4, 0);
        REQUIRE(trial_confirm(&firmware.trial));
        require_settled(4, TRIAL_CONFIRMED);
    }
    /* A firmware that is reset before it confirms itself, and then works. */
    set_up_trial(GOOD);
    for (int i = 0; i < 2; i++) {
        require_version(2, 0);
        run(5000);
        restart();
    }
    require_version(2, 0);
    REQUIRE(trial_confirm(&firmware.trial));
    require_settled(2, TRIAL_CONFIRMED);
}

/* What a start reports after a firmware that recorded nothing. */
static void test_report(void)
{
    set_up_trial(HANGS);
    power_up();
    require_version(1, TRIAL_STARTS);
    REQUIRE(firmware.report.cause == RESET_UNKNOWN && firmware.report.image == 1);
}

/* A power cycle is no failed start, and failures are counted from the last one on. */
static void test_power_cycles(void)
{
    for (size_t i = 0; i < sizeof(bad); i++) {
        set_up_trial(bad[i]);
        for (int cycle = 0; cycle < 5; cycle++) {
            for (unsigned failed = 0; failed < TRIAL_STARTS - 1; failed++) {
                REQUIRE(live() == 0);
            }
            power_up();
        }
        require_version(1, TRIAL_STARTS);
        require_settled(1, TRIAL_FELL_BACK);
    }
    set_up_trial(GOOD);
    for (int cycle = 0; cycle < 10; cycle++) {
        require_version(2, 0);
        run(5000);
        REQUIRE(reset_starts(cause) == 1 && trial_state(&firmware.trial) == TRIAL_RUNNING);
        power_up();
    }
    require_version(2, 0);
    REQUIRE(trial_confirm(&firmware.trial));
    require_settled(2, TRIAL_CONFIRMED);
}

/* The power fails in each operation of an update, of a confirmation, and of the old firmware's record that the new one
 * has failed. */
static void test_power(void)
{
    unsigned moments[3] = {0}, random = 11;
    uint8_t  version;
    unsigned failures;

    for (size_t i = 0; i <= sizeof(bad); i++) {
        char behaviour = i < sizeof(bad) ? bad[i] : GOOD;

        for (int part = CUT_BEFORE; part <= CUT_AFTER; part++) {
            for (unsigned cut = 1;; cut++) {
                set_up();
                require_version(1, 0);
                fake_flash.random            = next_random(&random);
                fake_flash.operations_to_cut = cut;
                fake_flash.cut               = (enum fake_flash_cut)part;
                if (update(behaviour, 2)) {
                    fake_flash.operations_to_cut = 0;
                    break;
                }
                moments[0]++;
                power_up();
                version = settle(&failures);
                REQUIRE(version == 1 ? failures == 0 || failures == TRIAL_STARTS : behaviour == GOOD && failures == 0);
                /* Then the same update again, not cut. */
                run(6200);
                REQUIRE(update(behaviour, 2));
                restart();
                version = settle(&failures);
                REQUIRE(behaviour == GOOD ? version == 2 && failures == 0 : version == 1 && failures == TRIAL_STARTS);
            }
            for (unsigned cut = 1;; cut++) {
                set_up_trial(behaviour);
                (void)settle(&failures);
                trial_confirm(&firmware.trial);
                fake_flash.random            = next_random(&random);
                fake_flash.operations_to_cut = cut;
                fake_flash.cut               = (enum fake_flash_cut)part;
                run(100);
                if (!fake_flash.dead) {
                    fake_flash.operations_to_cut = 0;
                    break;
                }
                moments[behaviour == GOOD ? 1 : 2]++;
                power_up();
                version = settle(&failures);
                REQUIRE(version == (behaviour == GOOD ? 2 : 1));
                trial_confirm(&firmware.trial);
                require_settled(version, behaviour == GOOD ? TRIAL_CONFIRMED : TRIAL_FELL_BACK);
            }
        }
    }
    /* Two records, a sector, three pages; a record. */
    REQUIRE(moments[0] == 5 * 3 * (3 + 1 + 3 + 3) && moments[1] == 3 * 3 && moments[2] == 4 * 3 * 3);
}

/* A confirmation that cannot be written is tried again a minute later. */
static void test_retry(void)
{
    set_up_trial(GOOD);
    require_version(2, 0);
    fake_flash.protect = true;
    REQUIRE(trial_confirm(&firmware.trial));
    run(100);
    REQUIRE(trial_status(&firmware.trial) == STATUS_PROTECTED);
    fake_flash.protect = false;
    run(5800);
    REQUIRE(trial_status(&firmware.trial) == STATUS_PROTECTED && reset_starts(cause) == 1);
    run(300);
    require_settled(2, TRIAL_CONFIRMED);
}

/* Records that do not fit the images are void: `make flash` writes both. */
static void test_foreign_record(void)
{
    static const trial_record_t records[] = {
        {TRIAL_RUNNING, 1, 0}, {TRIAL_CONFIRMED, 1, 0}, {TRIAL_FELL_BACK, 0, 0}, {TRIAL_RUNNING, 2, 0},
        {TRIAL_CONFIRMED, 0xffffffff, 0},
    };

    for (size_t i = 0; i < sizeof(records) / sizeof(records[0]); i++) {
        set_up();
        require_version(1, 0);
        REQUIRE(records_write(&firmware.records, RECORD_TRIAL, &records[i], sizeof(records[i])) == STATUS_OK);
        power_up();
        require_version(1, 0);
        REQUIRE(reset_image(cause) == 1 && trial_state(&firmware.trial) == TRIAL_NONE && cycles == HZ);
        /* Nor is a record of another size. */
        REQUIRE(records_write(&firmware.records, RECORD_TRIAL, &records[i], 8) == STATUS_OK);
        power_up();
        require_version(1, 0);
        REQUIRE(reset_image(cause) == 1 && trial_state(&firmware.trial) == TRIAL_NONE);
    }
}

/* An image that is damaged is not started, on trial or not. */
static void test_damaged(void)
{
    set_up_trial(GOOD);
    fake_flash.contents[IMAGE(1) + 100] ^= 1;
    require_version(1, 0);
    require_settled(1, TRIAL_FELL_BACK);
    /* The one that failed is better than none, and then is confirmed by what it does. */
    set_up_trial(GOOD);
    for (unsigned i = 0; i < TRIAL_STARTS; i++) {
        require_version(2, 0);
        restart();
    }
    fake_flash.contents[IMAGE(0) + 100] ^= 1;
    require_version(2, 0);
    REQUIRE(reset_image(cause) == 2 && trial_confirm(&firmware.trial));
    require_settled(2, TRIAL_CONFIRMED);
    /* None. */
    fake_flash.contents[IMAGE(1) + 100] ^= 1;
    REQUIRE(start_load(memory) == FLASH_IMAGES && control == RUNS);
}

/* A reset during an operation of the flash: the boot program waits for its end. */
static void test_busy(void)
{
    set_up_trial(GOOD);
    require_version(2, 0);
    REQUIRE(trial_confirm(&firmware.trial));
    run(100);
    fake_flash.busy_polls = 1000;
    REQUIRE(flash_begin_erase(&firmware.flash, IMAGE(0), now) == STATUS_OK);
    reset();
    require_version(2, 0);
    /* A flash that never ends, or does not answer, is given up. */
    fake_flash.present = false;
    REQUIRE(start_load(memory) == FLASH_IMAGES);
}

int main(void)
{
    test_good();
    test_bad();
    test_report();
    test_power_cycles();
    test_power();
    test_retry();
    test_foreign_record();
    test_damaged();
    test_busy();
    return 0;
}
