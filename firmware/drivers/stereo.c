/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/stereo.h"

#include <stddef.h>

#include "dma_memory.h"
#include "platform.h"

#define CONTROL_START   REGISTER_BIT(STEREO_CONTROL_START)
#define CONTROL_ABORT   REGISTER_BIT(STEREO_CONTROL_ABORT)

#define EVENT_DONE      REGISTER_BIT(STEREO_EV_PENDING_DONE)
#define EVENT_ERROR     REGISTER_BIT(STEREO_EV_PENDING_ERROR)

#define OPTION_XSOBEL   REGISTER_BIT(STEREO_OPTIONS_XSOBEL)
#define OPTION_SUBPIXEL REGISTER_BIT(STEREO_OPTIONS_SUBPIXEL)
#define OPTION_MEDIAN   REGISTER_BIT(STEREO_OPTIONS_MEDIAN)
#define OPTION_STREAMED REGISTER_BIT(STEREO_OPTIONS_STREAMED)
#define NO_CHECK        255u  /* As disp12_max_diff. */

#define OPTION_RECTIFIED REGISTER_BIT(STEREO_OPTIONS_RECTIFIED)
#define OPTION_GRID      REGISTER_BIT(STEREO_OPTIONS_GRID)
#define OPTION_LEFT_OUT  REGISTER_BIT(STEREO_OPTIONS_LEFT_OUT)
#define OPTION_RIGHT_OUT REGISTER_BIT(STEREO_OPTIONS_RIGHT_OUT)

/* The matcher needs a clock per pixel if memory keeps up. Sixteen clocks allow for a slow and busy memory, the constant
 * part for the overhead of a frame. */
#define BUDGET_PER_PIXEL 16u
#define BUDGET_PER_FRAME 100000u

/* Clocks that an abort may take: many times the longest burst. */
#define ABORT_BUDGET 100000u

#define REQUIRE_BIT(name) \
    _Static_assert(LITESTEREO_FEATURE_##name == REGISTER_BIT(STEREO_FEATURES_##name), \
        "enum litestereo_feature has the bits of the register");

LITESTEREO_STAGE_TABLE(REQUIRE_BIT)

static bool is_busy(void)
{
    return (stereo_status_read() & REGISTER_BIT(STEREO_STATUS_BUSY)) != 0;
}

/* Clears events that have not been handled. */
static void clear_events(stereo_t *stereo)
{
    stereo_ev_pending_write(EVENT_DONE | EVENT_ERROR);
    stereo->event = false;
}

/* Stops what runs; STATUS_TIMEOUT if it does not stop. */
static status_t stop(stereo_t *stereo)
{
    uint64_t begin = clock_now();

    stereo->busy = false;
    while (is_busy()) {
        /* Repeated, because the gateware ignores an abort while it checks the settings of a frame. */
        stereo_control_write(CONTROL_ABORT);
        if (clock_now() - begin > ABORT_BUDGET) {
            stereo->statistics.stuck++;
            return STATUS_TIMEOUT;
        }
    }
    clear_events(stereo);
    return STATUS_OK;
}

static bool capabilities_are_valid(const stereo_capabilities_t *can)
{
    const stereo_limits_t *limits = &can->limits;

    return can->version >> 8 == STEREO_GATEWARE_VERSION >> 8 && can->version >= STEREO_GATEWARE_VERSION
        && can->max_width > 0 && limits->max_disparities >= 16 && limits->max_disparities % 16 == 0
        && limits->min_block_size % 2 == 1 && limits->max_block_size % 2 == 1
        && limits->min_block_size <= limits->max_block_size
        && (limits->features & (LITESTEREO_FEATURE_XSOBEL | LITESTEREO_FEATURE_RAW)) != 0
        && can->dma_alignment > 0 && STEREO_MAX_ALIGNMENT % can->dma_alignment == 0;
}

status_t stereo_init(stereo_t *stereo)
{
    uint32_t block_sizes;
    status_t status;

    if (stereo == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    block_sizes = stereo_block_sizes_read();
    *stereo = (stereo_t){
        .capabilities = {
            .version         = (uint16_t)stereo_version_read(),
            .max_width       = (uint16_t)stereo_max_width_read(),
            .max_height      = STEREO_MAX_HEIGHT,
            .limits          = {
                .max_disparities   = (uint16_t)stereo_max_disparities_read(),
                .min_block_size    = (uint8_t)block_sizes,
                .max_block_size    = (uint8_t)(block_sizes >> 8),
                .features          = stereo_features_read(),
                .max_prefilter_cap = (uint8_t)stereo_max_prefilter_cap_read(),
            },
            .dma_alignment   = stereo_dma_alignment_read(),
        },
    };
    if (!capabilities_are_valid(&stereo->capabilities)) {
        return STATUS_UNSUPPORTED;
    }
    status = stop(stereo);
    stereo_ev_enable_write(EVENT_DONE | EVENT_ERROR);
    return status;
}

void stereo_on_end(stereo_t *stereo, stereo_handler_t handler, void *context)
{
    /* In this order an interrupt in between never calls a handler with the context of another. */
    stereo->handler = NULL;
    stereo->context = context;
    stereo->handler = handler;
}

/* Submitting a job. */

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

static bool has_rectification(const stereo_t *stereo)
{
    return (stereo->capabilities.limits.features & LITESTEREO_FEATURE_RECTIFICATION) != 0;
}

/* First field of the rectification that is not built, or where an image cannot be written. */
static stereo_field_t rectification_problem(const stereo_t *stereo, const stereo_job_t *job)
{
    uint32_t alignment = stereo->capabilities.dma_alignment;
    uint32_t bytes     = stereo_image_bytes(stereo, &job->settings);
    bool     built     = has_rectification(stereo);

    if (job->rectified && (!built || job->grid > 1)) {
        return STEREO_FIELD_RECTIFIED;
    }
    if (job->left_out != NULL && (!built || !dma_reaches(job->left_out, bytes, alignment))) {
        return STEREO_FIELD_LEFT_OUT;
    }
    if (job->right_out != NULL && (!built || !dma_reaches(job->right_out, bytes, alignment))) {
        return STEREO_FIELD_RIGHT_OUT;
    }
    return STEREO_FIELD_NONE;
}

/* First address of a job of a valid size whose bytes are not all in main RAM. Images of a streamed job are not read. */
static stereo_field_t memory_problem(const stereo_t *stereo, const stereo_job_t *job)
{
    uint32_t alignment = stereo->capabilities.dma_alignment;
    uint32_t bytes     = stereo_image_bytes(stereo, &job->settings);

    if (!job->streamed && !dma_reaches(job->left, bytes, alignment)) {
        return STEREO_FIELD_LEFT;
    }
    if (!job->streamed && !dma_reaches(job->right, bytes, alignment)) {
        return STEREO_FIELD_RIGHT;
    }
    if (!dma_reaches(job->map, stereo_map_bytes(stereo, &job->settings), alignment)) {
        return STEREO_FIELD_MAP;
    }
    return rectification_problem(stereo, job);
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
    return memory_problem(stereo, job);
}

static uint32_t rectification_options(const stereo_job_t *job)
{
    return (job->rectified ? OPTION_RECTIFIED | job->grid * OPTION_GRID : 0u)
        | (job->left_out != NULL ? OPTION_LEFT_OUT : 0u) | (job->right_out != NULL ? OPTION_RIGHT_OUT : 0u);
}

/* Writes the registers that the gateware takes over at the start of a frame. */
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
        | (settings->median ? OPTION_MEDIAN : 0u) | (job->streamed ? OPTION_STREAMED : 0u)
        | rectification_options(job));
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
    } else if (stereo->busy || is_busy()) {
        /* The gateware may be busy with a job that could not be stopped. */
        status = STATUS_BUSY;
    }
    if (status != STATUS_OK) {
        stereo->statistics.refused++;
        return status;
    }
    stereo_left_base_write((uint32_t)(uintptr_t)job->left);
    stereo_right_base_write((uint32_t)(uintptr_t)job->right);
    stereo_disparity_base_write((uint32_t)(uintptr_t)job->map);
    if (has_rectification(stereo)) {
        stereo_left_out_base_write((uint32_t)(uintptr_t)job->left_out);
        stereo_right_out_base_write((uint32_t)(uintptr_t)job->right_out);
    }
    write_settings(job);
    clear_events(stereo);
    memory_to_device();
    stereo->busy = true;
    stereo->statistics.submitted++;
    stereo_allow(stereo, clock, stereo_budget(&job->settings));
    stereo_control_write(CONTROL_START);
    return STATUS_OK;
}

/* The end of a job. */

static stereo_error_t read_error(void)
{
    return (stereo_error_t)REGISTER_FIELD(STEREO_STATUS_ERROR, stereo_status_read());
}

static status_t give_up(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    uint64_t waited = clock - stereo->started;

    stereo->statistics.timeouts++;
    stop(stereo);
    result->error  = read_error();
    result->clocks = waited < UINT32_MAX ? (uint32_t)waited : UINT32_MAX;
    return STATUS_TIMEOUT;
}

static status_t fail(stereo_t *stereo, stereo_error_t error)
{
    switch (error) {
    case STEREO_ERROR_CONFIG:  stereo->statistics.config_errors++; break;
    case STEREO_ERROR_ABORTED: stereo->statistics.aborted++;       break;
    default:                   stereo->statistics.bus_errors++;    break;
    }
    return STATUS_MATCHER;
}

static status_t succeed(stereo_t *stereo, stereo_result_t *result)
{
    stereo_statistics_t *statistics = &stereo->statistics;

    result->clocks           = stereo_clocks_read();
    result->first_row_clocks = stereo_first_row_clocks_read();
    if (has_rectification(stereo)) {
        uint32_t flags = stereo_rectification_read();

        result->row_gone = (flags & REGISTER_BIT(STEREO_RECTIFICATION_ROW_GONE)) != 0;
        result->folded   = (flags & REGISTER_BIT(STEREO_RECTIFICATION_FOLDED)) != 0;
    }
    statistics->done++;
    statistics->clocks += result->clocks;
    if (result->clocks > statistics->longest_clocks) {
        statistics->longest_clocks = result->clocks;
    }
    memory_from_device();
    return STATUS_OK;
}

/* Polls the gateware itself, not the flag that the interrupt sets. */
static status_t poll_gateware(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    *result = (stereo_result_t){0};
    if (is_busy()) {
        return clock - stereo->started > stereo->budget ? give_up(stereo, clock, result) : STATUS_BUSY;
    }
    stereo->busy  = false;
    stereo->event = false;
    result->error = read_error();
    return result->error == STEREO_ERROR_NONE ? succeed(stereo, result) : fail(stereo, result->error);
}

status_t stereo_poll(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    bool     no_event = !stereo->event;
    status_t status;

    if (!stereo->busy) {
        return STATUS_IDLE;
    }
    if (no_event && clock - stereo->started <= stereo->budget) {
        return STATUS_BUSY;
    }
    status = poll_gateware(stereo, clock, result);
    /* Over budget but not busy: the interrupt was lost, and the map is valid all the same. */
    if (no_event && (status == STATUS_OK || status == STATUS_MATCHER)) {
        stereo->statistics.lost_interrupts++;
    }
    return status;
}

status_t stereo_wait(stereo_t *stereo, stereo_result_t *result)
{
    status_t status;

    do {
        status = stereo->busy ? poll_gateware(stereo, clock_now(), result) : STATUS_IDLE;
    } while (status == STATUS_BUSY);
    return status;
}

status_t stereo_abort(stereo_t *stereo)
{
    if (stereo->busy) {
        stereo->statistics.aborted++;
    }
    return stop(stereo);
}

void stereo_isr(stereo_t *stereo)
{
    uint32_t         pending = stereo_ev_pending_read();
    stereo_handler_t handler = stereo->handler;

    /* Cleared first, so that an event during the handler is pending again. */
    stereo_ev_pending_write(pending);
    if (pending == 0) {
        return;
    }
    stereo->event = true;
    stereo->statistics.interrupts++;
    if (handler != NULL) {
        handler(stereo->context);
    }
}
