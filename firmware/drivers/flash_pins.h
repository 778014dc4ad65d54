/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The pins of the flash, which the CPU drives by software. */

#ifndef LITESTEREO_DRIVERS_FLASH_PINS_H
#define LITESTEREO_DRIVERS_FLASH_PINS_H

#include "registers.h"

#define CLOCK  REGISTER_BIT(FLASH_W_CLK)
#define MOSI   REGISTER_BIT(FLASH_W_MOSI)
#define OUTPUT REGISTER_BIT(FLASH_W_OE)
#define SELECT REGISTER_BIT(FLASH_W_CS)

/* Sends a byte, high bit first, and returns the byte received at the same time; SPI mode 0. */
static uint8_t flash_transfer(uint8_t out)
{
    uint32_t in = 0;

    for (int bit = 7; bit >= 0; bit--) {
        uint32_t pins = SELECT | OUTPUT | ((out >> bit) & 1 ? MOSI : 0);

        flash_w_write(pins);
        flash_w_write(pins | CLOCK);
        in = (in << 1) | ((flash_r_read() & REGISTER_BIT(FLASH_R_MISO)) != 0);
    }
    return (uint8_t)in;
}

/* Ends a command. */
static void flash_deselect(void)
{
    flash_w_write(OUTPUT | SELECT);
    flash_w_write(OUTPUT);
}

enum { COMMAND_STATUS = 0x05 };

/* Bit of the status register: operation in progress. */
enum { STATUS_BIT_BUSY = 0x01 };

static uint8_t flash_read_status(void)
{
    uint8_t status;

    flash_transfer(COMMAND_STATUS);
    status = flash_transfer(0);
    flash_deselect();
    return status;
}

#endif
