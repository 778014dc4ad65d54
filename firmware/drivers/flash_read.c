/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reading alone, which is all that the boot program has room for. */

#include "litestereo/flash.h"

#include <generated/csr.h>

#ifdef CSR_FLASH_BASE

#include "flash_pins.h"

enum { COMMAND_READ = 0x03 };

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

#else

void flash_read(uint32_t address, void *data, uint32_t length)
{
    uint8_t *bytes = data;

    (void)address;
    while (length-- > 0) {
        *bytes++ = 0xff;
    }
}

#endif
