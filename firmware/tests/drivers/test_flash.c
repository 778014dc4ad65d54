/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The flash's driver against a flash in software. */

#include "litestereo/flash.h"

#include <string.h>

#include "fake_flash.h"
#include "require.h"

#define FIRST 0x100000u
#define END   0x180000u  /* Of the images; the records follow. */
#define LAST  0x1d0000u  /* End of the records. */
#define HZ    1000u

static flash_t flash;

static status_t settle(void)
{
    status_t status;

    for (int polls = 0; (status = flash_poll(&flash, flash.began)) == STATUS_BUSY; polls++) {
        REQUIRE(polls < 100);
    }
    return status;
}

static void set_up(void)
{
    fake_flash_reset();
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
}

static void test_id(void)
{
    static const uint32_t unfit[] = {
        0, 0xffffff, 0x0040ff, 0xef4014, 0xef4010, 0xef4020, 0xef40ff, 0x00ef15, 0xff4015,
    };

    set_up();
    REQUIRE(flash.id == 0xef4015 && flash.images == 2 && flash.images_offset == FIRST && flash.image_bytes == 0x40000);
    REQUIRE(flash.records_offset == END && flash.records_bytes == LAST - END);
    for (size_t i = 0; i < sizeof(unfit) / sizeof(unfit[0]); i++) {
        fake_flash.id = unfit[i];
        REQUIRE(flash_init(&flash, HZ) == STATUS_UNSUPPORTED);
    }
    fake_flash.id = 0xc84018;
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    fake_flash.present = false;
    REQUIRE(flash_init(&flash, HZ) == STATUS_UNSUPPORTED);
}

static void test_erase(void)
{
    set_up();
    memset(fake_flash.contents, 0x55, FAKE_FLASH_BYTES);
    REQUIRE(flash_begin_erase(&flash, FIRST + 4096, 0) == STATUS_OK);
    REQUIRE(flash_poll(&flash, 0) == STATUS_BUSY);
    /* It accepts no other command until then, and the driver sends none. */
    REQUIRE(flash_begin_erase(&flash, FIRST, 0) == STATUS_BUSY);
    REQUIRE(settle() == STATUS_OK && !fake_flash_in_use() && fake_flash.operations == 1);
    for (uint32_t i = 0; i < FAKE_FLASH_BYTES; i++) {
        REQUIRE(fake_flash.contents[i] == (i / 4096 == FIRST / 4096 + 1 ? 0xff : 0x55));
    }
}

static void test_program(void)
{
    uint8_t bytes[256], read[256];

    set_up();
    for (unsigned i = 0; i < sizeof(bytes); i++) {
        bytes[i] = (uint8_t)(i * 7 + 1);
    }
    REQUIRE(flash_begin_program(&flash, FIRST, bytes, 256, 0) == STATUS_OK && settle() == STATUS_OK);
    flash_read(FIRST, read, 256);
    REQUIRE(memcmp(read, bytes, 256) == 0);
    REQUIRE(flash_begin_program(&flash, FIRST + 256 + 40, bytes, 3, 0) == STATUS_OK && settle() == STATUS_OK);
    flash_read(FIRST + 256 + 38, read, 6);
    REQUIRE(memcmp(read, "\xff\xff\x01\x08\x0f\xff", 6) == 0);
    /* Programming does not set bits. */
    REQUIRE(flash_begin_program(&flash, FIRST + 256 + 40, (const uint8_t *)"\xf0", 1, 0) == STATUS_OK);
    REQUIRE(settle() == STATUS_OK && fake_flash.contents[FIRST + 256 + 40] == 0x00);
}

/* Nothing outside of images and records is written, as it may be the bitstream, nor anything that crosses a page. */
static void test_bounds(void)
{
    uint8_t bytes[512] = {0};

    set_up();
    REQUIRE(flash_begin_erase(&flash, 0, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, FIRST - 4096, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, LAST, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, END + 256, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, FIRST + 256, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, 0xfffff000, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, FIRST - 1, bytes, 1, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, LAST, bytes, 1, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, LAST - 1, bytes, 2, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, FIRST, bytes, 0, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, FIRST, bytes, 257, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, FIRST + 1, bytes, 256, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(fake_flash.operations == 0);
    REQUIRE(flash_begin_erase(&flash, END - 4096, 0) == STATUS_OK && settle() == STATUS_OK);
    REQUIRE(flash_begin_program(&flash, END - 256, bytes, 256, 0) == STATUS_OK && settle() == STATUS_OK);
    REQUIRE(flash_begin_erase(&flash, END, 0) == STATUS_OK && settle() == STATUS_OK);
    REQUIRE(flash_begin_erase(&flash, LAST - 4096, 0) == STATUS_OK && settle() == STATUS_OK);
    REQUIRE(flash_begin_program(&flash, END, bytes, 1, 0) == STATUS_OK && settle() == STATUS_OK);
    REQUIRE(flash_begin_program(&flash, LAST - 256, bytes, 256, 0) == STATUS_OK && settle() == STATUS_OK);
    /* The two regions are apart: what lies between is not writable. */
    flash.records_offset += 4096;
    flash.records_bytes  -= 4096;
    REQUIRE(flash_begin_erase(&flash, END, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, END + 4095, bytes, 1, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, END + 4096, 0) == STATUS_OK && settle() == STATUS_OK);
}

/* A SoC without a place for records: its images alone are writable. */
static void test_no_records(void)
{
    uint8_t byte = 0;

    set_up();
    flash.records_offset = flash.records_bytes = 0;
    REQUIRE(flash_begin_erase(&flash, 0, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_program(&flash, 0, &byte, 1, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, END, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(flash_begin_erase(&flash, END - 4096, 0) == STATUS_OK && settle() == STATUS_OK);
}

static void test_faults(void)
{
    uint8_t byte = 0;

    set_up();
    fake_flash.locked = true;
    REQUIRE(flash_begin_erase(&flash, FIRST, 0) == STATUS_PROTECTED);
    REQUIRE(flash_begin_program(&flash, FIRST, &byte, 1, 0) == STATUS_PROTECTED);
    fake_flash.locked = false;
    REQUIRE(!flash_is_protected(&flash));
    fake_flash.protect = true;
    REQUIRE(flash_is_protected(&flash));
    fake_flash.protect = false;
    fake_flash.stuck   = true;
    REQUIRE(flash_begin_program(&flash, FIRST, &byte, 1, 5000) == STATUS_OK);
    REQUIRE(flash_poll(&flash, 5000 + HZ) == STATUS_BUSY && flash_poll(&flash, 5001 + HZ) == STATUS_TIMEOUT);
    fake_flash.stuck = false;
    REQUIRE(settle() == STATUS_OK);
    /* An erase may take longer. */
    fake_flash.stuck = true;
    REQUIRE(flash_begin_erase(&flash, FIRST, 5000) == STATUS_OK);
    REQUIRE(flash_poll(&flash, 5000 + 5 * HZ) == STATUS_BUSY && flash_poll(&flash, 5001 + 5 * HZ) == STATUS_TIMEOUT);
}

int main(void)
{
    test_id();
    test_erase();
    test_program();
    test_bounds();
    test_no_records();
    test_faults();
    return 0;
}
