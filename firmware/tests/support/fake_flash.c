/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_flash.h"

#include <string.h>

#include "generated/csr.h"
#include "lib/bytes.h"
#include "litestereo/crc32.h"
#include "require.h"

enum { CLOCK = 1, MOSI = 2, OUTPUT = 4, SELECT = 16 };
enum { PROGRAM = 0x02, READ = 0x03, DISABLE = 0x04, STATUS = 0x05, ENABLE = 0x06, ERASE = 0x20, ID = 0x9f };

#define PAGE   256u
#define SECTOR 4096u
#define LAST   (FAKE_FLASH_BYTES - 1)

fake_flash_t fake_flash;

static struct {
    uint32_t pins;     /* As last written. */
    uint32_t bits;     /* Clocks since it was selected. */
    uint32_t command;  /* The first 32 bits. */
    uint32_t data;     /* The bits after these. */
    uint8_t  page[PAGE];
    uint32_t bytes;    /* Bytes after the address. */
    bool     enabled;
    unsigned polls;    /* Polls of the status until the operation has ended. */
} chip;

void fake_flash_reset(void)
{
    memset(&chip, 0, sizeof(chip));
    memset(&fake_flash, 0, sizeof(fake_flash));
    memset(fake_flash.contents, 0xff, sizeof(fake_flash.contents));
    fake_flash.present    = true;
    fake_flash.id         = 0xef4015;
    fake_flash.busy_polls = 3;
    fake_flash.random     = 1;
}

void fake_flash_power_up(void)
{
    memset(&chip, 0, sizeof(chip));
    fake_flash.dead            = false;
    fake_flash.operations_to_cut = 0;
}

bool fake_flash_in_use(void)
{
    return (chip.pins & (SELECT | CLOCK)) != 0;
}

void fake_flash_put_image(uint32_t address, const uint8_t *firmware, uint32_t length)
{
    put_u32(fake_flash.contents + address, length);
    put_u32(fake_flash.contents + address + 4, crc32_update(0, firmware, length));
    memcpy(fake_flash.contents + address + 8, firmware, length);
}

/* Erasing and programming. */

static void erase(uint32_t address, bool midway)
{
    uint8_t *byte = fake_flash.contents + address / SECTOR * SECTOR;

    for (uint32_t i = 0; i < SECTOR; i++) {
        byte[i] |= midway ? (uint8_t)next_random(&fake_flash.random) : 0xff;
    }
}

static void program(uint32_t address, bool midway)
{
    uint32_t page = address / PAGE * PAGE;

    for (uint32_t i = 0; i < PAGE; i++) {
        uint32_t at   = page + i;
        uint8_t  keep = midway ? (uint8_t)next_random(&fake_flash.random) : 0;

        if (at != fake_flash.worn || at == 0) {
            fake_flash.contents[at] &= chip.page[i] | keep;
        }
    }
}

static void operate(uint8_t command, uint32_t address)
{
    bool fails  = fake_flash.operations_to_cut == 1;
    bool midway = fails && fake_flash.cut == CUT_MIDWAY;

    fake_flash.operations++;
    fake_flash.operations_to_cut -= fake_flash.operations_to_cut > 0;
    fake_flash.dead = fails;
    if (fake_flash.protect || (fails && fake_flash.cut == CUT_BEFORE)) {
        return;
    }
    if (command == ERASE) {
        erase(address, midway);
    } else {
        program(address, midway);
    }
    chip.polls = fake_flash.busy_polls;
}

/* The end of a command. */
static void end(void)
{
    uint8_t  command = (uint8_t)(chip.bits < 32 ? chip.command : chip.command >> 24);
    uint32_t address = chip.command & LAST;
    bool     whole   = command == ERASE ? chip.bits == 32 : chip.bytes > 0 && chip.bits % 8 == 0;

    if (chip.polls > 0) {
        return;
    }
    if (command == ENABLE && chip.bits == 8) {
        chip.enabled = !fake_flash.locked;
    } else if (command == DISABLE && chip.bits == 8) {
        chip.enabled = false;
    } else if ((command == ERASE || command == PROGRAM) && chip.enabled && whole) {
        chip.enabled = false;
        operate(command, address);
    }
}

/* The pins. SPI mode 0: the flash samples a bit at the rising edge, and outputs one at the falling edge. */

static void take_bit(uint32_t bit)
{
    if (chip.bits < 32) {
        chip.command = chip.command << 1 | bit;
    } else {
        chip.data = chip.data << 1 | bit;
        if (chip.bits % 8 == 7) {
            chip.page[(chip.command + chip.bytes++) % PAGE] = (uint8_t)chip.data;
        }
    }
    chip.bits++;
    if (chip.bits == 8 && chip.command == STATUS && chip.polls > 0 && !fake_flash.stuck) {
        chip.polls--;
    }
}

void flash_w_write(uint32_t value)
{
    bool selected = (value & SELECT) != 0 && (chip.pins & SELECT) == 0;
    bool deselected = (value & SELECT) == 0 && (chip.pins & SELECT) != 0;
    bool rising   = (value & CLOCK) != 0 && (chip.pins & CLOCK) == 0;

    REQUIRE((value & OUTPUT) != 0);
    if (selected) {
        chip.bits = chip.command = chip.bytes = 0;
        memset(chip.page, 0xff, PAGE);
        fake_flash.selects++;
    }
    if ((value & SELECT) != 0 && rising) {
        take_bit((value & MOSI) != 0);
    }
    chip.pins = value;
    if (deselected && fake_flash.present && !fake_flash.dead) {
        end();
    }
}

/* The byte being output after a command of `bits` bits; 0xff if the command has no answer. */
static uint8_t shown(uint32_t *bits)
{
    uint8_t command = (uint8_t)(chip.bits < 32 ? chip.command >> (chip.bits - 8) : chip.command >> 24);

    *bits = 8;
    if (command == STATUS) {
        return (uint8_t)((chip.polls > 0) | chip.enabled << 1 | (fake_flash.protect ? 0x1c : 0));
    }
    if (chip.polls > 0) {
        return 0xff;
    }
    if (command == ID) {
        return (uint8_t)(fake_flash.id >> (16 - (chip.bits - 9) / 8 % 3 * 8));
    }
    *bits = 32;
    if (command != READ || chip.bits <= 32) {
        return 0xff;
    }
    return fake_flash.contents[((chip.command & LAST) + (chip.bits - 33) / 8) & LAST];
}

uint32_t flash_r_read(void)
{
    uint32_t bits;
    uint8_t  byte;

    if (chip.bits <= 8 || !fake_flash.present || fake_flash.dead) {
        return 3;
    }
    byte = shown(&bits);
    return 2u | (byte >> (7 - (chip.bits - 1 - bits) % 8) & 1u);
}
