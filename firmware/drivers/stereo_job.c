/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* From a job to the registers. */

#include "litestereo/stereo.h"

#include <stddef.h>

#include "stereo_control.h"

#define OPTION_XSOBEL   (1u << 0)
#define OPTION_SUBPIXEL (1u << 1)
#define OPTION_MEDIAN   (1u << 2)
#define OPTION_STREAMED (1u << 3)
#define NO_CHECK        255u  /* As disp12_max_diff. */

/* The matcher takes a pixel per clock where memory keeps up. Sixteen clocks leave room for a slow and busy memory,
 * the rest for what a frame costs beside its pixels. */
#define BUDGET_PER_PIXEL 16u
#define BUDGET_PER_FRAME 100000u

static uint32_t padded(const stereo_t *stereo, const stereo_settings_t *settings, uint32_t bytes)
{
    uint32_t step = stereo->capabilities.dma_alignment;

    return (bytes * settings->width * settings->height + step - 1) / step * step;
}

uint32_t stereo_image_bytes(const stereo_t *stereo, const stereo_settings_t *settings)
{
    return padded(stereo, settings, 1);
}

uint32_t stereo_map_bytes(const stereo_t *stereo, const stereo_settings_t *settings)
{
    return padded(stereo, settings, sizeof(int16_t));
}

static bool is_aligned(const stereo_t *stereo, const void *address)
{
    return address != NULL && (uintptr_t)address % stereo->capabilities.dma_alignment == 0;
}

stereo_field_t stereo_check(const stereo_t *stereo, const stereo_job_t *job)
{
    const stereo_capabilities_t *can      = &stereo->capabilities;
    const stereo_settings_t     *settings = &job->settings;
    stereo_field_t               bad;

    if (!is_aligned(stereo, job->left)) {
        return STEREO_FIELD_LEFT;
    }
    if (!is_aligned(stereo, job->right)) {
        return STEREO_FIELD_RIGHT;
    }
    if (!is_aligned(stereo, job->map)) {
        return STEREO_FIELD_MAP;
    }
    bad = stereo_settings_check(settings, &can->limits);
    if (bad != STEREO_FIELD_NONE) {
        return bad;
    }
    if (settings->width > can->max_width || settings->width < stereo_settings_min_width(settings)) {
        return STEREO_FIELD_WIDTH;
    }
    if (settings->height > can->max_height || settings->height < settings->block_size) {
        return STEREO_FIELD_HEIGHT;
    }
    return STEREO_FIELD_NONE;
}

/* The registers of the settings, which are taken over at the start of a frame. */
static void write_settings(const stereo_job_t *job)
{
    const stereo_settings_t *settings = &job->settings;

    stereo_width_write(settings->width);
    stereo_height_write(settings->height);
    stereo_disparities_write(settings->disparities);
    stereo_block_size_write(settings->block_size);
    stereo_min_disparity_write(settings->min_disparity);
    stereo_prefilter_cap_write(settings->prefilter_cap);
    stereo_texture_threshold_write(settings->texture_threshold);
    stereo_uniqueness_ratio_write(settings->uniqueness_ratio);
    stereo_disp12_max_diff_write(settings->disp12_max_diff < 0 ? NO_CHECK : (uint8_t)settings->disp12_max_diff);
    stereo_options_write((settings->xsobel ? OPTION_XSOBEL : 0u) | (settings->subpixel ? OPTION_SUBPIXEL : 0u)
        | (settings->median ? OPTION_MEDIAN : 0u) | (job->streamed ? OPTION_STREAMED : 0u));
}

uint64_t stereo_budget(const stereo_settings_t *settings)
{
    return BUDGET_PER_FRAME + (uint64_t)BUDGET_PER_PIXEL * settings->width * settings->height;
}

void stereo_allow(stereo_t *stereo, uint64_t clock, uint64_t budget)
{
    stereo->started = clock;
    stereo->budget  = budget;
}

status_t stereo_submit(stereo_t *stereo, const stereo_job_t *job, uint64_t clock)
{
    status_t status = STATUS_OK;

    if (stereo == NULL || job == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    if (stereo_check(stereo, job) != STEREO_FIELD_NONE) {
        status = STATUS_BAD_ARGUMENT;
    } else if (stereo->busy || stereo_is_busy()) {
        /* The gateware may be busy with a job that the watchdog could not stop. */
        status = STATUS_BUSY;
    }
    if (status != STATUS_OK) {
        stereo->statistics.refused++;
        return status;
    }
    stereo_left_base_write((uint32_t)(uintptr_t)job->left);
    stereo_right_base_write((uint32_t)(uintptr_t)job->right);
    stereo_disparity_base_write((uint32_t)(uintptr_t)job->map);
    write_settings(job);
    stereo_clear_events(stereo);
    memory_to_device();
    stereo->busy = true;
    stereo->statistics.submitted++;
    stereo_allow(stereo, clock, stereo_budget(&job->settings));
    stereo_control_write(CONTROL_START);
    return STATUS_OK;
}
