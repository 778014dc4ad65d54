/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "lib/pattern.h"
#include "litestereo/crc32.h"
#include "litestereo/platform.h"
#include "reference/stereo_bm.h"

/* Seeds of the patterns in the left and the right image. */
#define LEFT_SEED  1u
#define RIGHT_SEED 2u

/* Matches a frame and prints how long it took. */
typedef void (*measure_t)(console_t *console, frame_t *frame);

/* Reads a number from 1 to `most`; 0 if the word is anything else. */
static unsigned parse_number(const char *word, unsigned long most)
{
    char         *end;
    unsigned long value = strtoul(word, &end, 10);

    return *word >= '0' && *word <= '9' && *end == 0 && value <= most ? (unsigned)value : 0;
}

static void fill_with_pattern(frame_t *frame)
{
    pattern_fill(frame_left(frame), frame_pixels(frame), LEFT_SEED);
    pattern_fill(frame_right(frame), frame_pixels(frame), RIGHT_SEED);
    frame_fill(frame);
}

static void print_measurement(console_t *console, const char *command, const frame_t *frame, uint32_t clocks,
    uint32_t first_row_clocks)
{
    const stereo_settings_t *settings = &frame->settings;

    console_printf(console, "%s: width=%u height=%u disparities=%u block_size=%u clocks=%u first_row_clocks=%u"
        " crc32=0x%08x\n", command, settings->width, settings->height, settings->disparities, settings->block_size,
        (unsigned)clocks, (unsigned)first_row_clocks,
        (unsigned)crc32_update(0, frame_map(frame), frame_map_size(frame)));
}

static void measure_accelerator(console_t *console, frame_t *frame)
{
    fill_with_pattern(frame);
    if (matcher_run(console->matcher, frame) != FRAME_DONE) {
        print_failure(console, "bench", frame);
        return;
    }
    print_measurement(console, "bench", frame, frame->result.clocks, frame->result.first_row_clocks);
}

static void measure_cpu(console_t *console, frame_t *frame)
{
    uint64_t begin;

    fill_with_pattern(frame);
    begin = clock_now();
    stereo_bm(&frame->settings, frame_left(frame), frame_right(frame), (int16_t *)(void *)frame_map(frame),
        cpu_scratch);
    print_measurement(console, "cpu_bench", frame, (uint32_t)(clock_now() - begin), 0);
}

/* Parses the settings of a command; returns whether they are numbers and `all` or `sad`. */
static bool parse_settings(const stereo_limits_t *limits, char **argv, stereo_settings_t *settings)
{
    bool all = strcmp(argv[5], "all") == 0;

    *settings = all ? settings_with_all_stages(limits) : stereo_settings_bare(limits);
    settings->width       = (uint16_t)parse_number(argv[1], UINT16_MAX);
    settings->height      = (uint16_t)parse_number(argv[2], UINT16_MAX);
    settings->disparities = (uint16_t)parse_number(argv[3], UINT16_MAX);
    settings->block_size  = (uint8_t)parse_number(argv[4], UINT8_MAX);
    return settings->width != 0 && settings->height != 0 && settings->disparities != 0 && settings->block_size != 0
        && (all || strcmp(argv[5], "sad") == 0);
}

/* The setting that matcher or CPU does not allow; NULL if all are allowed. */
static const char *refusal(const console_t *console, frame_t *frame, uint32_t max_scratch_words)
{
    stereo_job_t   job = matcher_job(frame);
    stereo_field_t bad = stereo_check(console->matcher->stereo, &job);

    if (bad != STEREO_FIELD_NONE) {
        return stereo_field_name(bad);
    }
    return stereo_bm_scratch_words(&frame->settings) > max_scratch_words ? "width, the CPU has too little memory"
                                                                         : NULL;
}

static bool bench(console_t *console, char **argv, const char *command, uint32_t max_scratch_words, measure_t measure)
{
    stereo_settings_t settings;
    frame_t          *frame;
    const char       *bad;

    if (!parse_settings(&console->info->limits, argv, &settings)) {
        return false;
    }
    switch (frame_pool_open(console->matcher->pool, FRAME_OWNER_CONSOLE, 0, &settings, &frame)) {
    case STATUS_OK:
        bad = refusal(console, frame, max_scratch_words);
        if (bad == NULL) {
            measure(console, frame);
        } else {
            console_printf(console, "%s: refused: bad %s\n", command, bad);
        }
        frame_release(frame);
        break;
    case STATUS_SIZE:
        console_printf(console, "%s: refused: a slot holds at most %u pixels\n", command,
            (unsigned)console->matcher->pool->max_pixels);
        break;
    default:
        console_printf(console, "%s: refused: no slot is free\n", command);
        break;
    }
    return true;
}

bool command_bench(console_t *console, char **argv)
{
    return bench(console, argv, "bench", UINT32_MAX, measure_accelerator);
}

bool command_cpu_bench(console_t *console, char **argv)
{
    return bench(console, argv, "cpu_bench", CPU_SCRATCH_WORDS, measure_cpu);
}
