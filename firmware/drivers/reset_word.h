/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The register reset_record_cause, as reset.c and the boot program use it. */

#ifndef LITESTEREO_DRIVERS_RESET_WORD_H
#define LITESTEREO_DRIVERS_RESET_WORD_H

#include <stdint.h>

/* Fields from bit 0 up: cause; starts of a firmware on trial that it has not confirmed; 1 + the image that the boot
 * program has started, 0 if there is no boot program; resets; line. */
#define RESET_CAUSE_MOST   0xfu
#define RESET_STARTS_SHIFT 4
#define RESET_STARTS_MOST  0x3u
#define RESET_IMAGE_SHIFT  6
#define RESET_IMAGE_MOST   0x3u
#define RESET_RESETS_SHIFT 8
#define RESET_RESETS_MOST  0xffu
#define RESET_LINE_SHIFT   16

/* The fields that only the boot program, and reset_forget_starts, change. */
#define RESET_BOOT_MASK (RESET_STARTS_MOST << RESET_STARTS_SHIFT | RESET_IMAGE_MOST << RESET_IMAGE_SHIFT)

static inline uint32_t reset_starts(uint32_t word)
{
    return word >> RESET_STARTS_SHIFT & RESET_STARTS_MOST;
}

static inline uint32_t reset_image(uint32_t word)
{
    return word >> RESET_IMAGE_SHIFT & RESET_IMAGE_MOST;
}

#endif
