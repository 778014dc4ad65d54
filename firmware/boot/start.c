/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "start.h"

#include <generated/csr.h>
#include <generated/soc.h>

#include <litestereo/reset.h>
#include <litestereo/watchdog.h>

#include <stdbool.h>

#include "drivers/reset_word.h"
#include "drivers/trial_choice.h"
#include "image.h"

enum { LARGEST_BYTES = FLASH_IMAGE_BYTES - FLASH_HEADER_BYTES };

/* Polls of a busy flash, a microsecond or more each. The reset may have come during an erase. */
#define MOST_POLLS 1000000u

/* Notes the image and the number of its starts. A start after one that was not confirmed is no power-up, even if that
 * firmware has recorded nothing. */
static void note(uint32_t starts, uint32_t image)
{
    uint32_t word = reset_record_cause_read();

    if (reset_starts(word) > 0 && (word & RESET_CAUSE_MOST) == RESET_POWER_UP) {
        word |= RESET_UNKNOWN;
    }
    reset_record_cause_write((word & ~RESET_BOOT_MASK) | starts << RESET_STARTS_SHIFT | (image + 1) << RESET_IMAGE_SHIFT);
}

uint32_t start_load(void *memory)
{
    uint32_t starts = reset_starts(reset_record_cause_read());
    uint32_t first;
    bool     on_trial;

    for (uint32_t polls = 0; polls < MOST_POLLS && flash_is_busy(); polls++) {
    }
    first = trial_choose(&starts, &on_trial);
    for (uint32_t i = 0; i < FLASH_IMAGES; i++) {
        uint32_t image = (first + i) % FLASH_IMAGES;

        if (image_load(FLASH_IMAGES_OFFSET + image * FLASH_IMAGE_BYTES, memory, LARGEST_BYTES) > 0) {
            note(starts, image);
            if (on_trial && i == 0) {
                watchdog_start(TRIAL_WATCHDOG_S * CONFIG_CLOCK_FREQUENCY);
            }
            return image;
        }
    }
    return FLASH_IMAGES;
}
