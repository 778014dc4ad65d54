/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The boot program's way to the flash, against a flash in software behind the pins: images good, damaged and missing. */

#include "boot/image.h"

#include <string.h>

#include "generated/csr.h"
#include "litestereo/crc32.h"
#include "require.h"

enum { FLASH_BYTES = 8192, FIRMWARE_BYTES = 1000 };

static uint8_t  contents[FLASH_BYTES];
static uint32_t pins;     /* As last written. */
static unsigned bits;     /* Clocks since it was selected. */
static uint32_t command;  /* The first 32 bits. */
static unsigned selects;

/* Mode 0: the flash takes a bit with the rising clock, and shows one with the falling one. */
void flash_w_write(uint32_t value)
{
    REQUIRE((value & 4) != 0);
    if ((value & 0x10) != 0 && (pins & 0x10) == 0) {
        bits = 0;
        selects++;
    }
    if ((value & 0x10) != 0 && (value & 1) != 0 && (pins & 1) == 0) {
        if (bits < 32) {
            command = (command << 1) | ((value >> 1) & 1);
        }
        bits++;
    }
    pins = value;
}

uint32_t flash_r_read(void)
{
    uint32_t place;

    if (bits <= 32) {
        return 2;
    }
    REQUIRE(command >> 24 == 0x03);
    place = (command & 0xffffff) * 8 + bits - 33;
    return 2 | ((contents[place / 8 % FLASH_BYTES] >> (7 - place % 8)) & 1);
}

static void put_image(uint32_t address, uint32_t seed)
{
    uint32_t length = FIRMWARE_BYTES, crc;

    for (unsigned byte = 0; byte < FIRMWARE_BYTES; byte++) {
        contents[address + 8 + byte] = (uint8_t)next_random(&seed);
    }
    crc = crc32_update(0, contents + address + 8, FIRMWARE_BYTES);
    memcpy(contents + address, &length, 4);
    memcpy(contents + address + 4, &crc, 4);
}

static void test_good(void)
{
    uint8_t memory[FIRMWARE_BYTES + 1] = {0};

    put_image(4096, 1);
    REQUIRE(image_load(4096, memory, FIRMWARE_BYTES) == FIRMWARE_BYTES);
    REQUIRE(memcmp(memory, contents + 4104, FIRMWARE_BYTES) == 0);
    REQUIRE(memory[FIRMWARE_BYTES] == 0);
    REQUIRE(selects == 2 && (pins & 0x11) == 0);
}

static void test_refused(void)
{
    uint8_t memory[FIRMWARE_BYTES];

    /* Longer than there is room: nothing is copied. */
    put_image(0, 2);
    memset(memory, 7, sizeof(memory));
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES - 1) == 0);
    REQUIRE(memory[0] == 7 && memory[FIRMWARE_BYTES - 1] == 7);
    /* A bit that has changed, in the firmware or in its checksum. */
    contents[500] ^= 1;
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    contents[500] ^= 1;
    contents[4] ^= 1;
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    /* An erased flash, and one that is not there. */
    memset(contents, 0xff, sizeof(contents));
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    memset(contents, 0, sizeof(contents));
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
}

int main(void)
{
    test_good();
    test_refused();
    return 0;
}
