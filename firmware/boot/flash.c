/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "flash.h"

#include <generated/csr.h>

enum { COMMAND_READ = 0x03 };

/* Bits of the register of LiteX's SPIMaster. */
enum { CLOCK = 1 << 0, MOSI = 1 << 1, OUTPUT = 1 << 2, SELECT = 1 << 4 };

/* Sends a byte, high bit first, and returns the one that comes back meanwhile: mode 0. */
static uint8_t transfer(uint8_t out)
{
    uint32_t in = 0;

    for (int bit = 7; bit >= 0; bit--) {
        uint32_t pins = SELECT | OUTPUT | ((out >> bit) & 1 ? MOSI : 0);

        flash_w_write(pins);
        flash_w_write(pins | CLOCK);
        in = (in << 1) | (flash_r_read() & 1);
    }
    return (uint8_t)in;
}

void flash_read(uint32_t address, void *data, uint32_t length)
{
    uint8_t *bytes = data;

    /* An ECP5 swallows the first clocks that it is given for the flash: they come while nothing is selected. */
    for (int clock = 0; clock < 8; clock++) {
        flash_w_write(OUTPUT);
        flash_w_write(OUTPUT | CLOCK);
    }
    flash_w_write(OUTPUT);
    transfer(COMMAND_READ);
    transfer((uint8_t)(address >> 16));
    transfer((uint8_t)(address >> 8));
    transfer((uint8_t)address);
    while (length-- > 0) {
        *bytes++ = transfer(0);
    }
    flash_w_write(OUTPUT | SELECT);
    flash_w_write(OUTPUT);
}
