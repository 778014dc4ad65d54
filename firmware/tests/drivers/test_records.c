/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Records in a flash in software: sizes at and around each limit, damage, faults, sequence numbers, and a power failure
 * in every operation of a write and of an erase. */

#include "litestereo/records.h"

#include <string.h>

#include "drivers/record_copy.h"
#include "fake_flash.h"
#include "litestereo/crc32.h"
#include "litestereo/platform.h"
#include "require.h"

#define FIRST 0x180000u
#define END   0x1d0000u
#define HZ    1000000u
#define KIND  RECORD_CALIBRATION
#define COPY(number) (FIRST + (uint32_t)(KIND * 2 + (number)) * RECORD_COPY_BYTES)
#define CONTENTS fake_flash.contents

static flash_t   flash;
static records_t records;
static uint64_t  now;
static uint8_t   old[RECORD_MOST_BYTES], new[RECORD_MOST_BYTES + 1], found[RECORD_MOST_BYTES + 1];
static uint32_t  found_size;

uint64_t clock_now(void)
{
    return now += 1000;
}

static void fill(uint8_t *bytes, uint32_t size, unsigned seed)
{
    for (uint32_t i = 0; i < size; i++) {
        bytes[i] = (uint8_t)next_random(&seed);
    }
}

static void start(void)
{
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK && records_init(&records, &flash) == STATUS_OK);
}

static void set_up(void)
{
    fake_flash_reset();
    fill(old, sizeof(old), 1);
    fill(new, sizeof(new), 2);
    start();
}

static status_t read_record(void)
{
    memset(found, 0x77, sizeof(found));
    found_size = 0x12345;
    return records_read(&records, KIND, found, RECORD_MOST_BYTES, &found_size);
}

static bool reads(const uint8_t *bytes, uint32_t size)
{
    return read_record() == STATUS_OK && found_size == size && memcmp(found, bytes, size) == 0 && found[size] == 0x77;
}

static status_t write_record(const uint8_t *bytes, uint32_t size)
{
    return records_write(&records, KIND, bytes, size);
}

/* Stores a copy by hand; copies -1 and 2 are those of the neighbours in flash. */
static void put_copy(int copy, uint32_t sequence, const uint8_t *bytes, uint32_t size)
{
    uint32_t        kind   = (uint32_t)(2 * KIND + copy) / 2;
    record_header_t header = {.magic = RECORD_MAGIC, .kind = kind, .sequence = sequence, .size = size};

    header.crc32 = crc32_update(record_header_crc(&header), bytes, size);
    memset(CONTENTS + COPY(copy), 0xff, RECORD_COPY_BYTES);
    memcpy(CONTENTS + COPY(copy), &header, sizeof(header));
    memcpy(CONTENTS + COPY(copy) + RECORD_DATA_OFFSET, bytes, size);
}

static uint32_t sequence_of(unsigned copy)
{
    record_header_t header;

    memcpy(&header, CONTENTS + COPY(copy), sizeof(header));
    return header.sequence;
}

static void test_good(void)
{
    set_up();
    REQUIRE(read_record() == STATUS_NO_RECORD && records_erase(&records, KIND) == STATUS_OK);
    REQUIRE(fake_flash.operations == 0);
    REQUIRE(write_record(old, 700) == STATUS_OK && reads(old, 700));
    /* Erase a sector; program three pages and the header. */
    REQUIRE(fake_flash.operations == 1 + 3 + 1 && !fake_flash_in_use());
    REQUIRE(write_record(new, 700) == STATUS_OK && reads(new, 700) && fake_flash.operations == 10);
    /* The layout in flash. */
    REQUIRE(memcmp(CONTENTS + COPY(0), "LSRC\1\0\0\0\0\0\0\0\xbc\2\0\0", 16) == 0);
    REQUIRE(memcmp(CONTENTS + COPY(1), "LSRC\1\0\0\0\1\0\0\0\xbc\2\0\0", 16) == 0);
    REQUIRE(memcmp(CONTENTS + COPY(1) + 256, new, 700) == 0 && memcmp(CONTENTS + COPY(0) + 256, old, 700) == 0);
    /* The same bytes are not written again; a changed or missing byte is. */
    REQUIRE(write_record(new, 700) == STATUS_OK && fake_flash.operations == 10);
    REQUIRE(write_record(new, 699) == STATUS_OK && reads(new, 699) && fake_flash.operations == 15);
    new[698] ^= 1;
    REQUIRE(write_record(new, 699) == STATUS_OK && reads(new, 699) && fake_flash.operations == 20);
    REQUIRE(records_erase(&records, KIND) == STATUS_OK && read_record() == STATUS_NO_RECORD);
    REQUIRE(fake_flash.operations == 22);
    /* Erasing nothing does nothing. */
    REQUIRE(records_erase(&records, KIND) == STATUS_OK && fake_flash.operations == 22);
    REQUIRE(write_record(old, 5) == STATUS_OK && reads(old, 5));
}

static void test_sizes(void)
{
    static const uint32_t sizes[] = {0, 1, 2, 255, 256, 257, 511, 512, 513, 3839, 3840, 3841, 4095, 4096, 4097, 7935, 7936,
        7937, 8192, 10240, 12032, 16384, RECORD_MOST_BYTES - 257, RECORD_MOST_BYTES - 256, RECORD_MOST_BYTES - 1,
        RECORD_MOST_BYTES};

    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        uint32_t size    = sizes[i];
        unsigned sectors = (256 + size + 4095) / 4096, pages = (size + 255) / 256;

        set_up();
        /* Neighbours on both sides of the record. */
        put_copy(-1, 1, new, RECORD_MOST_BYTES);
        put_copy(2, 1, old, RECORD_MOST_BYTES);
        for (int round = 0; round < 3; round++) {
            fake_flash.operations = 0;
            old[0] ^= 1;
            REQUIRE(write_record(old, size) == STATUS_OK && reads(old, size));
            REQUIRE(fake_flash.operations == (size == 0 && round > 0 ? 0 : sectors + pages + 1));
        }
        REQUIRE(records_read(&records, KIND - 1, found, RECORD_MOST_BYTES, &found_size) == STATUS_OK);
        REQUIRE(found_size == RECORD_MOST_BYTES && memcmp(found, new, RECORD_MOST_BYTES) == 0);
        REQUIRE(records_read(&records, KIND + 1, found, RECORD_MOST_BYTES, &found_size) == STATUS_OK);
        REQUIRE(found_size == RECORD_MOST_BYTES && memcmp(found + 1, old + 1, RECORD_MOST_BYTES - 1) == 0);
        /* Nothing else in flash is changed. */
        for (uint32_t at = 0; at < FAKE_FLASH_BYTES; at++) {
            if (at < COPY(-1) || at >= COPY(3)) {
                REQUIRE(CONTENTS[at] == 0xff);
            }
        }
    }
}

static void test_refused(void)
{
    records_t none;
    flash_t   bare;

    set_up();
    REQUIRE(write_record(new, RECORD_MOST_BYTES + 1) == STATUS_LENGTH && write_record(new, 0xffffffff) == STATUS_LENGTH);
    REQUIRE(write_record(NULL, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_write(&records, RECORD_KINDS, new, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_write(&records, 0xffffffff, new, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_erase(&records, RECORD_KINDS) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_write(NULL, KIND, new, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_read(&records, RECORD_KINDS, found, 1, &found_size) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_read(&records, KIND, NULL, 1, &found_size) == STATUS_BAD_ARGUMENT);
    REQUIRE(records_read(&records, KIND, found, 1, NULL) == STATUS_BAD_ARGUMENT);
    REQUIRE(fake_flash.operations == 0 && records_poll(&records, 0) == STATUS_IDLE);
    /* The last kind ends where the region ends. */
    REQUIRE(records_write(&records, RECORD_KINDS - 1, old, RECORD_MOST_BYTES) == STATUS_OK);
    REQUIRE(records_write(&records, RECORD_KINDS - 1, new, RECORD_MOST_BYTES) == STATUS_OK);
    REQUIRE(CONTENTS[END - 1] == new[RECORD_MOST_BYTES - 1]);
    /* A buffer that is too small is not touched, but the size is told. */
    REQUIRE(write_record(old, 300) == STATUS_OK);
    memset(found, 0x77, sizeof(found));
    REQUIRE(records_read(&records, KIND, found, 299, &found_size) == STATUS_LENGTH && found_size == 300);
    REQUIRE(found[0] == 0x77);
    REQUIRE(records_read(&records, KIND, NULL, 0, &found_size) == STATUS_LENGTH && found_size == 300);
    REQUIRE(records_read(&records, KIND, found, 300, &found_size) == STATUS_OK && found[300] == 0x77);
    /* One write at a time, and no reading during it. */
    REQUIRE(records_begin_write(&records, KIND, new, 10) == STATUS_OK);
    REQUIRE(records_begin_write(&records, KIND, new, 10) == STATUS_BUSY && read_record() == STATUS_BUSY);
    REQUIRE(records_erase(&records, KIND) == STATUS_BUSY && write_record(old, 10) == STATUS_BUSY);
    while (records_poll(&records, now += 1000) == STATUS_BUSY) {
    }
    REQUIRE(records_poll(&records, now) == STATUS_IDLE && reads(new, 10));
    /* While the flash is busy with something else. */
    REQUIRE(flash_begin_erase(&flash, 0x100000, now) == STATUS_OK && read_record() == STATUS_BUSY);
    REQUIRE(write_record(old, 10) == STATUS_OK && reads(old, 10));
    /* Without a place for records. */
    bare               = flash;
    bare.records_bytes = FLASH_SECTOR_BYTES;
    REQUIRE(records_init(&none, &bare) == STATUS_UNSUPPORTED);
    REQUIRE(records_write(&none, KIND, new, 1) == STATUS_UNSUPPORTED);
    REQUIRE(records_erase(&none, KIND) == STATUS_UNSUPPORTED);
    REQUIRE(records_read(&none, KIND, found, 1, &found_size) == STATUS_UNSUPPORTED);
}

/* Damage of one copy brings back the other; of both, none. */
static void test_damage(void)
{
    static const uint32_t places[] = {0, 3, 4, 8, 12, 13, 16, 19, 256, 256 + 511};

    for (size_t i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
        for (uint8_t bit = 1; bit != 0; bit = (uint8_t)(bit << 7)) {
            set_up();
            REQUIRE(write_record(old, 512) == STATUS_OK && write_record(new, 512) == STATUS_OK);
            CONTENTS[COPY(1) + places[i]] ^= bit;
            REQUIRE(reads(old, 512));
            CONTENTS[COPY(0) + places[i]] ^= bit;
            REQUIRE(read_record() == STATUS_NO_RECORD && found[0] == 0x77 && found_size == 0x12345);
            REQUIRE(records_erase(&records, KIND) == STATUS_OK);
            CONTENTS[COPY(1) + places[i]] ^= bit;
            REQUIRE(reads(new, 512));
            /* The damaged copy is the one that is replaced. */
            REQUIRE(write_record(old, 100) == STATUS_OK && reads(old, 100));
            CONTENTS[COPY(0)] ^= 1;
            REQUIRE(reads(new, 512));
        }
    }
    /* A record in the place of another kind is none; nor is one that claims to be longer than its place. */
    set_up();
    REQUIRE(records_write(&records, KIND + 1, old, 10) == STATUS_OK);
    memcpy(CONTENTS + COPY(0), CONTENTS + COPY(2), RECORD_COPY_BYTES);
    REQUIRE(read_record() == STATUS_NO_RECORD);
    put_copy(0, 0, old, 10);
    REQUIRE(reads(old, 10));
    for (uint32_t size = RECORD_MOST_BYTES; size <= RECORD_MOST_BYTES + 1; size++) {
        record_header_t header = {.magic = RECORD_MAGIC, .kind = KIND, .size = size};

        header.crc32 = crc32_update(record_header_crc(&header), CONTENTS + COPY(0) + RECORD_DATA_OFFSET, size);
        memcpy(CONTENTS + COPY(0), &header, sizeof(header));
        REQUIRE(read_record() == (size == RECORD_MOST_BYTES ? STATUS_OK : STATUS_NO_RECORD));
    }
}

/* The newest copy is the one whose sequence number is ahead, modulo 2**32. */
static void test_sequence(void)
{
    static const struct {
        uint32_t first, second;
        bool     second_is_newer;
    } cases[] = {
        {0, 1, true}, {1, 0, false}, {0xffffffff, 0, true}, {0, 0xffffffff, false}, {0x7fffffff, 0x80000000, true},
        {0x80000000, 0x7fffffff, false}, {0, 0x7fffffff, true}, {0xfffffffe, 0xffffffff, true},
        {5, 5, false}, {0, 0x80000000, false}, {0x80000000, 0, false},
    };

    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        uint32_t newest = cases[i].second_is_newer ? cases[i].second : cases[i].first;

        set_up();
        put_copy(0, cases[i].first, old, 20);
        put_copy(1, cases[i].second, new, 30);
        REQUIRE(cases[i].second_is_newer ? reads(new, 30) : reads(old, 20));
        /* The next write replaces the other copy, and is the newest. */
        REQUIRE(write_record(old + 100, 40) == STATUS_OK && reads(old + 100, 40));
        REQUIRE(sequence_of(cases[i].second_is_newer ? 0 : 1) == newest + 1);
    }
    /* Writing across the wrap-around. */
    set_up();
    put_copy(1, 0xfffffffd, old, 50);
    for (uint32_t round = 0; round < 8; round++) {
        REQUIRE(write_record(new + round, 50) == STATUS_OK && reads(new + round, 50));
        REQUIRE(sequence_of(round % 2) == 0xfffffffe + round);
    }
}

static void test_faults(void)
{
    for (int kind = 0; kind < 2; kind++) {
        set_up();
        REQUIRE(write_record(old, 500) == STATUS_OK);
        fake_flash.locked  = kind == 0;
        fake_flash.protect = kind == 1;
        REQUIRE(write_record(new, 500) == STATUS_PROTECTED && reads(old, 500));
        REQUIRE(records_erase(&records, KIND) == STATUS_PROTECTED && reads(old, 500));
        fake_flash.locked = fake_flash.protect = false;
        REQUIRE(write_record(new, 500) == STATUS_OK && reads(new, 500));
    }
    /* A byte of the data, and one of the header, that cannot be programmed. */
    for (int kind = 0; kind < 2; kind++) {
        set_up();
        REQUIRE(write_record(old, 500) == STATUS_OK);
        fake_flash.worn = COPY(1) + (kind == 0 ? 600 : 2);
        memset(new, 0, 500);
        REQUIRE(write_record(new, 500) == STATUS_CRC && reads(old, 500));
        REQUIRE(write_record(new, 500) == STATUS_CRC && reads(old, 500));
    }
    /* Operations that never end: each wait is bounded. */
    set_up();
    REQUIRE(write_record(old, 500) == STATUS_OK);
    fake_flash.stuck = true;
    REQUIRE(write_record(new, 500) == STATUS_TIMEOUT && read_record() == STATUS_BUSY);
    REQUIRE(write_record(new, 500) == STATUS_TIMEOUT && records_erase(&records, KIND) == STATUS_TIMEOUT);
    fake_flash.stuck = false;
    while (flash_poll(&flash, flash.began) == STATUS_BUSY) {
    }
    REQUIRE(write_record(new, 500) == STATUS_OK && reads(new, 500));
    /* A flash that is gone. */
    fake_flash.present = false;
    REQUIRE(write_record(old, 500) == STATUS_TIMEOUT && read_record() == STATUS_BUSY);
}

/* The state before a write that is cut: no record, one copy, both copies; older ones are of other sizes. */
static void prepare(unsigned copies)
{
    set_up();
    if (copies >= 2) {
        put_copy(0, 0xffffffff, new + 3000, 9000);
    }
    if (copies >= 1) {
        put_copy(1, 0, old, 5000);
    }
}

static bool reads_old(unsigned copies)
{
    return copies == 0 ? read_record() == STATUS_NO_RECORD : reads(old, 5000);
}

/* The power fails in each operation of a write, before, during and after it; then in that of another write. */
static void test_power_in_write(void)
{
    static const uint32_t sizes[] = {0, 1, 256, 3840, 3841, 5000};
    unsigned moments = 0, expected = 0, random = 7;

    for (unsigned copies = 0; copies < 3; copies++) {
        for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
            uint32_t size       = sizes[i];
            unsigned operations = (256 + size + 4095) / 4096 + (size + 255) / 256 + 1;

            expected += 3 * operations;
            for (unsigned cut = 1; cut <= operations; cut++) {
                for (int part = CUT_BEFORE; part <= CUT_AFTER; part++) {
                    bool is_whole = cut == operations && part == CUT_AFTER;

                    prepare(copies);
                    fake_flash.random            = next_random(&random);
                    fake_flash.operations_to_cut = cut;
                    fake_flash.cut               = (enum fake_flash_cut)part;
                    REQUIRE(write_record(new, size) != STATUS_OK && fake_flash.dead);
                    moments++;
                    fake_flash_power_up();
                    start();
                    /* Half-written bits may be all of those that had to change. */
                    REQUIRE(is_whole ? reads(new, size)
                        : reads_old(copies) || (cut == operations && part == CUT_MIDWAY && reads(new, size)));
                    /* And again: the record is the old one or the new one; then a write that is not cut. */
                    fake_flash.operations_to_cut = next_random(&random) % operations + 1;
                    fake_flash.cut               = (enum fake_flash_cut)(next_random(&random) % 3);
                    write_record(new, size);
                    fake_flash_power_up();
                    start();
                    REQUIRE(reads_old(copies) || reads(new, size));
                    REQUIRE(write_record(new, size) == STATUS_OK && reads(new, size));
                }
            }
        }
    }
    REQUIRE(moments == expected);
}

/* An erase never brings back a record that has been replaced. */
static void test_power_in_erase(void)
{
    unsigned random = 9;

    for (unsigned copies = 1; copies < 3; copies++) {
        for (unsigned cut = 1; cut <= 2; cut++) {
            for (int part = CUT_BEFORE; part <= CUT_AFTER; part++) {
                for (int draw = 0; draw < 8; draw++) {
                    prepare(copies);
                    fake_flash.random            = next_random(&random);
                    fake_flash.operations_to_cut = cut;
                    fake_flash.cut               = (enum fake_flash_cut)part;
                    REQUIRE(records_erase(&records, KIND) != STATUS_OK && fake_flash.dead);
                    fake_flash_power_up();
                    start();
                    if (cut == 1 || part == CUT_BEFORE) {
                        REQUIRE(reads_old(copies));
                    } else {
                        REQUIRE(read_record() == STATUS_NO_RECORD);
                    }
                    REQUIRE(records_erase(&records, KIND) == STATUS_OK && read_record() == STATUS_NO_RECORD);
                    REQUIRE(write_record(new, 77) == STATUS_OK && reads(new, 77));
                }
            }
        }
    }
}

int main(void)
{
    test_good();
    test_sizes();
    test_refused();
    test_damage();
    test_sequence();
    test_faults();
    test_power_in_write();
    test_power_in_erase();
    return 0;
}
