/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The SPI flash of bitstream and firmware, at pins that the CPU drives itself. */

#ifndef FLASH_H
#define FLASH_H

#include <stdint.h>

/* Reads from a byte address of the flash. */
void flash_read(uint32_t address, void *data, uint32_t length);

#endif
