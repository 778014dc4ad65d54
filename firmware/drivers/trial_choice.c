/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Apart from trial.c because the boot program has no room for more. */

#include "trial_choice.h"

#include "record_copy.h"
#include "registers.h"

/* Address of the checksum in the header of an image. */
static uint32_t checksum_address(uint32_t image)
{
    return FLASH_IMAGES_OFFSET + image * FLASH_IMAGE_BYTES + 4;
}

/* Whether there is an image of that index: a SoC without flash has none. */
static bool is_image(uint32_t index)
{
    const uint32_t images = FLASH_IMAGES;

    return index < images;
}

bool trial_read(trial_record_t *record)
{
    uint32_t        first = FLASH_RECORDS_OFFSET + RECORD_TRIAL * 2 * RECORD_COPY_BYTES;
    record_header_t header;
    uint32_t        copy, crc32;

    copy = FLASH_RECORDS_BYTES > 0 ? record_newest(first, RECORD_TRIAL, &header) : 0;
    if (copy == 0 || header.size != sizeof(*record)) {
        return false;
    }
    flash_read(copy + RECORD_DATA_OFFSET, record, sizeof(*record));
    if (!is_image(record->image)) {
        return false;
    }
    flash_read(checksum_address(record->image), &crc32, sizeof(crc32));
    return crc32 == record->crc32;
}

uint32_t trial_choose(uint32_t *starts, bool *on_trial)
{
    trial_record_t record;
    bool           known   = trial_read(&record);
    bool           running = known && record.state == TRIAL_RUNNING;

    *on_trial = running && *starts < TRIAL_STARTS;
    *starts   = *on_trial ? *starts + 1 : running ? *starts : 0;
    if (!known) {
        return 0;
    }
    if (*on_trial || record.state == TRIAL_CONFIRMED) {
        return record.image;
    }
    /* After a failed trial the next image is tried first. */
    return is_image(record.image + 1) ? record.image + 1 : 0;
}
