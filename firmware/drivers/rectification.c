/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/rectification.h"

#include <stddef.h>

#include "litestereo/watchdog.h"
#include "registers.h"

#define CAMERAS 2u
#define LOST    REGISTER_BIT(STEREO_RECTIFICATION_LOST)

/* Times that rectification_use loads a grid until gateware takes all of it; each takes about a millisecond. */
#define MOST_LOADS 2000u

status_t rectification_init(rectification_t *rectification, const stereo_t *stereo)
{
    uint32_t rows;

    *rectification = (rectification_t){0};
    if ((stereo->capabilities.limits.features & LITESTEREO_FEATURE_RECTIFICATION) == 0) {
        return STATUS_UNSUPPORTED;
    }
    rows = stereo_rows_read();
    rectification->rows       = (uint16_t)rows;
    rectification->max_width  = stereo->capabilities.max_width;
    rectification->max_height = (uint16_t)(rows >> 16);
    /* After a restart of the firmware alone the grids may be those of another calibration. */
    stereo_grid0_size_write(0);
    stereo_grid1_size_write(0);
    return STATUS_OK;
}

status_t rectification_begin(rectification_t *rectification, const uint8_t *record, uint32_t size)
{
    calibration_t *candidate = &rectification->candidate;
    status_t       status;

    if (rectification->rows == 0) {
        return STATUS_UNSUPPORTED;
    }
    if (rectification->checking) {
        return STATUS_BUSY;
    }
    status = calibration_parse(candidate, record, size);
    if (status != STATUS_OK) {
        return status;
    }
    if (candidate->width > rectification->max_width || candidate->height > rectification->max_height) {
        return STATUS_SIZE;
    }
    if (calibration_folds(candidate)) {
        return STATUS_BAD_ARGUMENT;
    }
    row_budget_begin(&rectification->budget, candidate);
    rectification->checking = true;
    return STATUS_OK;
}

static void write_size(unsigned grid, uint32_t size)
{
    if (grid == 0) {
        stereo_grid0_size_write(size);
    } else {
        stereo_grid1_size_write(size);
    }
}

/* Loads the nodes of a camera; STATUS_BUSY if gateware did not take them all. */
static status_t load_camera(const calibration_t *calibration, unsigned camera, unsigned grid)
{
    stereo_place_write(grid * REGISTER_BIT(STEREO_PLACE_GRID) | camera * REGISTER_BIT(STEREO_PLACE_CAMERA));
    for (uint32_t node = 0; node < calibration_nodes(calibration); node++) {
        stereo_node_write((uint16_t)calibration_node(calibration, camera, node, 0)
            | (uint32_t)(uint16_t)calibration_node(calibration, camera, node, 1) << 16);
    }
    return (stereo_rectification_read() & LOST) != 0 ? STATUS_BUSY : STATUS_OK;
}

/* Loads the candidate to the grid that is not in use. A frame with that grid may still be under way: it is the one that was
 * begun before the grid in use was loaded. */
static status_t load(rectification_t *rectification)
{
    const calibration_t *candidate = &rectification->candidate;
    unsigned             grid      = rectification->calibration.width != 0 ? 1u - rectification->grid : 0;
    status_t             status    = STATUS_OK;

    for (unsigned camera = 0; camera < CAMERAS && status == STATUS_OK; camera++) {
        status = load_camera(candidate, camera, grid);
    }
    if (status == STATUS_OK) {
        write_size(grid, candidate->width | (uint32_t)candidate->height << 16);
        rectification->grid        = (uint8_t)grid;
        rectification->calibration = *candidate;
    }
    return status;
}

status_t rectification_poll(rectification_t *rectification)
{
    status_t status;

    if (!rectification->checking) {
        return STATUS_IDLE;
    }
    if (rectification->budget.row < rectification->candidate.height && row_budget_step(&rectification->budget)) {
        return STATUS_BUSY;
    }
    rectification->rows_needed = (uint16_t)row_budget_rows(&rectification->budget);
    status = rectification->rows_needed > rectification->rows ? STATUS_ROWS : load(rectification);
    rectification->checking = status == STATUS_BUSY;
    return status;
}

status_t rectification_use(rectification_t *rectification, const uint8_t *record, uint32_t size)
{
    status_t status = rectification_begin(rectification, record, size);
    unsigned loads  = 0;

    if (status != STATUS_OK) {
        return status;
    }
    do {
        status = rectification_poll(rectification);
        loads += rectification->budget.row == rectification->candidate.height;
        watchdog_feed();
    } while (status == STATUS_BUSY && loads < MOST_LOADS);
    rectification->checking = false;
    return status == STATUS_BUSY ? STATUS_TIMEOUT : status;
}

void rectification_forget(rectification_t *rectification)
{
    rectification->calibration = (calibration_t){0};
    /* A frame under way keeps its grid. */
    write_size(0, 0);
    write_size(1, 0);
}
