/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdlib.h>

#include "commands.h"
#include "litestereo/crc32.h"
#include "pattern.h"

/* Seeds of the pattern in the left and the right image. */
#define LEFT_SEED  1u
#define RIGHT_SEED 2u

/* Reads a number from 1 to `most`; 0 if the word is anything else. */
static unsigned parse_number(const char *word, unsigned long most)
{
    char         *end;
    unsigned long value = strtoul(word, &end, 10);

    return *word >= '0' && *word <= '9' && *end == 0 && value <= most ? (unsigned)value : 0;
}

void print_failure(console_t *console, const char *command, const frame_t *frame)
{
    if (frame->result.error == ERROR_TIMEOUT) {
        console_printf(console, "%s: FAILED: the matcher did not finish in %u clocks\n", command,
            (unsigned)frame->result.detail);
    } else {
        console_printf(console, "%s: FAILED: the matcher ended with error %u\n", command,
            (unsigned)frame->result.detail);
    }
}

static void run(console_t *console, frame_t *frame)
{
    const frame_settings_t *settings = &frame->settings;
    stereo_job_t            job      = matcher_job(frame);
    stereo_field_t          bad      = stereo_check(console->matcher->stereo, &job);

    if (bad != STEREO_FIELD_NONE) {
        console_printf(console, "bench: refused: bad %s\n", stereo_field_name(bad));
        return;
    }
    pattern_fill(frame_left(frame), frame_pixels(frame), LEFT_SEED);
    pattern_fill(frame_right(frame), frame_pixels(frame), RIGHT_SEED);
    frame_fill(frame);
    if (matcher_run(console->matcher, frame) != FRAME_DONE) {
        print_failure(console, "bench", frame);
        return;
    }
    console_printf(console, "bench: width=%u height=%u disparities=%u block_size=%u clocks=%u first_row_clocks=%u"
        " crc32=0x%08x\n", settings->width, settings->height, settings->disparities, settings->block_size,
        (unsigned)frame->result.clocks, (unsigned)frame->result.first_row_clocks,
        (unsigned)crc32_update(0, frame_map(frame), frame_map_size(frame)));
}

bool command_bench(console_t *console, char **argv)
{
    frame_settings_t settings;
    frame_t         *frame;

    settings = (frame_settings_t){
        .width       = (uint16_t)parse_number(argv[1], UINT16_MAX),
        .height      = (uint16_t)parse_number(argv[2], UINT16_MAX),
        .disparities = (uint16_t)parse_number(argv[3], UINT16_MAX),
        .block_size  = (uint8_t)parse_number(argv[4], UINT8_MAX),
    };
    if (settings.width == 0 || settings.height == 0 || settings.disparities == 0 || settings.block_size == 0) {
        return false;
    }
    switch (frame_pool_open(console->matcher->pool, FRAME_OWNER_CONSOLE, 0, &settings, &frame)) {
    case STATUS_OK:
        run(console, frame);
        frame_release(frame);
        break;
    case STATUS_SIZE:
        console_printf(console, "bench: refused: a slot holds at most %u pixels\n",
            (unsigned)console->matcher->pool->max_pixels);
        break;
    default:
        console_printf(console, "bench: refused: no slot is free\n");
        break;
    }
    return true;
}
