/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The boot program against a flash in software: good, damaged and missing images. */

#include "boot/image.h"

#include <string.h>

#include "fake_flash.h"
#include "require.h"

enum { FIRMWARE_BYTES = 1000 };

#define CONTENTS fake_flash.contents

static void put_image(uint32_t address, uint32_t seed)
{
    uint8_t firmware[FIRMWARE_BYTES];

    for (unsigned byte = 0; byte < FIRMWARE_BYTES; byte++) {
        firmware[byte] = (uint8_t)next_random(&seed);
    }
    fake_flash_put_image(address, firmware, FIRMWARE_BYTES);
}

static void test_good(void)
{
    uint8_t memory[FIRMWARE_BYTES + 1] = {0};

    put_image(4096, 1);
    REQUIRE(image_load(4096, memory, FIRMWARE_BYTES) == FIRMWARE_BYTES);
    REQUIRE(memcmp(memory, CONTENTS + 4104, FIRMWARE_BYTES) == 0);
    REQUIRE(memory[FIRMWARE_BYTES] == 0);
    REQUIRE(fake_flash.selects == 2 && !fake_flash_in_use());
}

static void test_refused(void)
{
    uint8_t memory[FIRMWARE_BYTES];

    /* Too long: nothing is copied. */
    put_image(0, 2);
    memset(memory, 7, sizeof(memory));
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES - 1) == 0);
    REQUIRE(memory[0] == 7 && memory[FIRMWARE_BYTES - 1] == 7);
    /* A bit that has changed, in the firmware or in its checksum. */
    CONTENTS[500] ^= 1;
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    CONTENTS[500] ^= 1;
    CONTENTS[4] ^= 1;
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    /* An erased flash, and a missing one. */
    memset(CONTENTS, 0xff, FAKE_FLASH_BYTES);
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
    memset(CONTENTS, 0, FAKE_FLASH_BYTES);
    REQUIRE(image_load(0, memory, FIRMWARE_BYTES) == 0);
}

int main(void)
{
    fake_flash_reset();
    test_good();
    test_refused();
    return 0;
}
