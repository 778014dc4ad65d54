/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Records in flash: any sequence of writes, erases and reads, with power failures and damaged bits in between, against a
 * model that knows which records may be there. */

#include <stdbool.h>
#include <string.h>

#include "fake_flash.h"
#include "fuzz.h"
#include "litestereo/platform.h"
#include "litestereo/records.h"

#define HZ    1000000u
#define FIRST 0x180000u
#define END   0x1d0000u
#define KINDS 2u  /* The first and the last kind, at the ends of the region. */

/* A record: its size, and the byte that fills it; a negative size is none. */
typedef struct {
    int32_t size;
    uint8_t filled;
} content_t;

static flash_t   flash;
static records_t records;
static uint64_t  now;
static content_t content[KINDS];
static bool      damaged;  /* Bits were changed: a record may be the one before, or none. */
static uint8_t   bytes[RECORD_MOST_BYTES];

uint64_t clock_now(void)
{
    return now += 1000;
}

static uint32_t kind_of(unsigned number)
{
    return number == 0 ? 0 : RECORD_KINDS - 1;
}

static void start(void)
{
    fake_flash_power_up();
    HOLDS(flash_init(&flash, HZ) == STATUS_OK && records_init(&records, &flash) == STATUS_OK);
}

static content_t read_content(unsigned number)
{
    uint32_t size = 0;
    status_t status = records_read(&records, kind_of(number), bytes, sizeof(bytes), &size);

    HOLDS(status == STATUS_OK || status == STATUS_NO_RECORD);
    if (status == STATUS_NO_RECORD) {
        return (content_t){.size = -1};
    }
    HOLDS(size <= RECORD_MOST_BYTES);
    for (uint32_t i = 1; i < size; i++) {
        HOLDS(bytes[i] == bytes[0]);
    }
    return (content_t){.size = (int32_t)size, .filled = size > 0 ? bytes[0] : 0};
}

static bool is_same(content_t one, content_t other)
{
    return one.size == other.size && (one.size <= 0 || one.filled == other.filled);
}

/* Sizes at the limits more often than others. */
static uint32_t take_size(input_t *input)
{
    static const uint32_t limits[] = {0, 256, 3840, RECORD_MOST_BYTES};
    uint32_t chosen = take(input);

    return chosen < 128 ? chosen * 8 : limits[chosen % 4] - (limits[chosen % 4] > 0 ? chosen / 4 % 2 : 0);
}

static void change(input_t *input, unsigned number)
{
    bool      erases = take(input) % 4 == 0;
    content_t after  = {.size = -1};
    content_t found;
    status_t  status;

    fake_flash.random            = take(input) + 1u;
    fake_flash.operations_to_cut = take(input) % 32;
    fake_flash.cut               = (enum fake_flash_cut)(take(input) % 3);
    if (erases) {
        status = records_erase(&records, kind_of(number));
    } else {
        after.size   = (int32_t)take_size(input);
        after.filled = take(input);
        memset(bytes, after.filled, sizeof(bytes));
        status = records_write(&records, kind_of(number), bytes, (uint32_t)after.size);
    }
    if (!fake_flash.dead) {
        HOLDS(status == STATUS_OK);
        fake_flash.operations_to_cut = 0;
        content[number] = after;
    } else {
        start();
        found = read_content(number);
        HOLDS(damaged || is_same(found, content[number]) || is_same(found, after));
        content[number] = found;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t input = {data, size};

    fake_flash_reset();
    fake_flash.busy_polls = 0;
    damaged = false;
    start();
    for (unsigned number = 0; number < KINDS; number++) {
        content[number] = (content_t){.size = -1};
    }
    for (unsigned steps = 0; input.length > 0 && steps < 16; steps++) {
        uint8_t  action = take(&input);
        unsigned number = action % KINDS;

        if (action >= 240) {
            /* Damage to a copy's header and data, beyond what a power failure does. */
            uint32_t copy = FIRST + (kind_of(number) * 2 + action / 2 % 2) * RECORD_COPY_BYTES;

            fake_flash.contents[copy + take(&input) % 32] ^= take(&input);
            damaged = true;
            content[number] = read_content(number);
        } else {
            change(&input, number);
        }
        for (unsigned other = 0; other < KINDS; other++) {
            HOLDS(is_same(read_content(other), content[other]));
        }
    }
#ifdef PLANTED_FAULT
    /* The planted fault: something else writes to the copies. */
    fake_flash.contents[FIRST + RECORD_COPY_BYTES] &= 0x0f;
    HOLDS(is_same(read_content(0), content[0]));
#endif
    for (uint32_t at = 0x100000; at < FAKE_FLASH_BYTES; at += 4096) {
        HOLDS((at >= FIRST && at < END) || fake_flash.contents[at] == 0xff);
    }
    return 0;
}
