/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/firmware_tag.h"

#include "platform.h"

/* The Makefile computes it from the headers that LiteX generates. */
#ifndef SOC_CHECKSUM
#define SOC_CHECKSUM 0
#endif

/* The Makefile sets the flag of our own program. */
#ifndef FIRMWARE_FLAGS
#define FIRMWARE_FLAGS 0
#endif

_Static_assert(sizeof(firmware_tag_t) == 32, "host tools know the layout");
_Static_assert(sizeof(LITESTEREO_NAME) <= FIRMWARE_TAG_NAME_SIZE, "the name and its zero fit");

/* The linker script places it at the very end. */
__attribute__((section(".firmware_tag"), used)) const firmware_tag_t firmware_tag = {
    .magic   = {'L', 'S', 'F', 'W'},
    .soc     = SOC_CHECKSUM,
    .version = FIRMWARE_VERSION,
    .flags   = FIRMWARE_FLAGS,
    .name    = LITESTEREO_NAME,
};
