/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Settings of a kind of sensor, and their limits. No sensor is touched. */

#include "sensor_model.h"

const char *sensor_name(const sensor_model_t *model)
{
    return model->name;
}

sensor_format_t sensor_format(const sensor_model_t *model)
{
    return model->format;
}

uint32_t sensor_clock_hz(const sensor_model_t *model, uint32_t master_hz)
{
    return master_hz >= model->least_hz && master_hz <= model->most_hz ? master_hz * model->clocks : 0;
}

/* Whether columns, or rows, of a window are within the array; `binned` are those of the sensor. */
static bool fits(const sensor_model_t *model, uint32_t binned, uint32_t first, uint32_t all)
{
    bool good = binned != 0 && first + binned <= all && binned % model->multiple == 0 && first % model->multiple == 0;

    return good && (!model->whole || binned == all);
}

static status_t check_window(const sensor_model_t *model, const sensor_settings_t *settings)
{
    uint32_t binning = settings->binning;
    bool     known   = binning == 1 || binning == 2 || binning == 4;
    bool     good    = known && (model->binnings & binning) != 0
        && fits(model, settings->width * binning, settings->column, model->columns)
        && fits(model, settings->height * binning, settings->row, model->rows);

    return good ? STATUS_OK : STATUS_SIZE;
}

status_t sensor_timing(const sensor_model_t *model, const sensor_settings_t *settings, sensor_timing_t *timing)
{
    status_t status = check_window(model, settings);

    if (status == STATUS_OK) {
        *timing = model->timing(settings);
    }
    return status;
}

exposure_limits_t sensor_exposure_limits(const sensor_model_t *model, const sensor_settings_t *settings)
{
    return (exposure_limits_t){
        .least_exposure = 1, .most_exposure = (uint16_t)(settings->frame_rows - model->exposure_rows),
        .least_gain = 16, .most_gain = model->most_gain,
    };
}

status_t sensor_check(const sensor_model_t *model, const sensor_settings_t *settings)
{
    sensor_timing_t   timing;
    exposure_limits_t limits;
    status_t          status = sensor_timing(model, settings, &timing);

    if (status != STATUS_OK) {
        return status;
    }
    if (settings->row_clocks < timing.least_row_clocks || settings->row_clocks > timing.most_row_clocks
        || settings->frame_rows < timing.least_frame_rows || settings->frame_rows > timing.most_frame_rows) {
        return STATUS_BAD_ARGUMENT;
    }
    limits = sensor_exposure_limits(model, settings);
    return exposure_check(&limits, settings->exposure, settings->gain);
}

status_t sensor_defaults(const sensor_model_t *model, uint16_t width, uint16_t height, sensor_settings_t *settings)
{
    for (uint8_t binning = 4; binning != 0; binning >>= 1) {
        uint32_t          columns = width * (uint32_t)binning, rows = height * (uint32_t)binning;
        sensor_settings_t found = {.width = width, .height = height, .binning = binning, .gain = 16};
        sensor_timing_t   timing;

        /* Of a window that is too large this is no place, and it is refused by its size. */
        found.column = (uint16_t)((model->columns - columns) / 2 / model->multiple * model->multiple);
        found.row    = (uint16_t)((model->rows - rows) / 2 / model->multiple * model->multiple);
        if (sensor_timing(model, &found, &timing) == STATUS_OK) {
            found.row_clocks = timing.least_row_clocks;
            found.frame_rows = (uint16_t)(rows + model->blank_rows);
            found.exposure   = found.frame_rows / 2;
            *settings        = found;
            return STATUS_OK;
        }
    }
    return STATUS_SIZE;
}

uint32_t sensor_rate(const sensor_model_t *model, const sensor_settings_t *settings, uint32_t master_hz)
{
    uint64_t clocks = (uint64_t)settings->row_clocks * settings->frame_rows;
    uint64_t hz     = sensor_clock_hz(model, master_hz);

    return clocks == 0 ? 0 : (uint32_t)((hz * 1000 + clocks / 2) / clocks);
}

status_t sensor_set_rate(const sensor_model_t *model, sensor_settings_t *settings, uint32_t master_hz, uint32_t rate)
{
    uint64_t          row_rate = (uint64_t)settings->row_clocks * rate;
    uint64_t          hz       = sensor_clock_hz(model, master_hz);
    uint64_t          rows     = row_rate == 0 ? 0 : (hz * 1000 + row_rate / 2) / row_rate;
    sensor_settings_t changed  = *settings;
    status_t          status;

    if (rows > UINT16_MAX) {
        return STATUS_BAD_ARGUMENT;
    }
    changed.frame_rows = (uint16_t)rows;
    status             = sensor_check(model, &changed);
    if (status == STATUS_OK) {
        *settings = changed;
    }
    return status;
}
