/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reading the flash, apart from flash.c because the boot program has no room for more. */

#include "litestereo/flash.h"

#include "flash_pins.h"

enum { COMMAND_READ = 0x03 };

void flash_read(uint32_t address, void *data, uint32_t length)
{
    uint8_t *bytes = data;

    /* An ECP5 swallows the first clocks for the flash, so some are made before the flash is selected. */
    for (int clock = 0; clock < 8; clock++) {
        flash_w_write(OUTPUT);
        flash_w_write(OUTPUT | CLOCK);
    }
    flash_w_write(OUTPUT);
    flash_transfer(COMMAND_READ);
    flash_transfer((uint8_t)(address >> 16));
    flash_transfer((uint8_t)(address >> 8));
    flash_transfer((uint8_t)address);
    while (length-- > 0) {
        *bytes++ = flash_transfer(0);
    }
    flash_deselect();
}

bool flash_is_busy(void)
{
    uint8_t nothing;

    /* The FPGA may swallow the first clocks: flash_read makes some before it selects the flash. */
    flash_read(0, &nothing, 0);
    return (flash_read_status() & STATUS_BIT_BUSY) != 0;
}
