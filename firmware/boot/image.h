/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Images of the firmware in flash. */

#ifndef IMAGE_H
#define IMAGE_H

#include <stdint.h>

/* Copies the firmware of the image at an address of the flash to memory. Returns its length in bytes; 0 if it is longer
 * than `room_bytes`, or if its checksum does not match. */
uint32_t image_load(uint32_t address, void *memory, uint32_t room_bytes);

#endif
