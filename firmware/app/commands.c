/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "commands.h"

#include <stddef.h>

uint32_t cpu_scratch[CPU_SCRATCH_WORDS];

stereo_settings_t settings_with_all_stages(const stereo_limits_t *limits)
{
    static const struct {
        stereo_field_t field;
        int32_t        value;
    } wanted[] = {
        {STEREO_FIELD_MIN_DISPARITY,     3},
        {STEREO_FIELD_TEXTURE_THRESHOLD, 60},
        {STEREO_FIELD_UNIQUENESS_RATIO,  5},
        {STEREO_FIELD_DISP12_MAX_DIFF,   1},
        {STEREO_FIELD_MEDIAN,            1},
    };
    stereo_settings_t settings = stereo_settings_default(limits);

    for (size_t i = 0; i < sizeof(wanted) / sizeof(wanted[0]); i++) {
        /* A setting without its stage is refused, and keeps its value. */
        (void)stereo_settings_set(&settings, limits, wanted[i].field, wanted[i].value);
    }
    return settings;
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
