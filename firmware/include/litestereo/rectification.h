/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The rectification before the matcher, by the calibration that it was given.
 *
 * rectification_init once, after stereo_init; then rectification_use with a calibration. Jobs whose settings have its
 * size may then set `rectified`, with the `grid` of the handle:
 *
 *   job.rectified = true;
 *   job.grid      = rectification.grid;
 *
 * Gateware has two grids, so a calibration may be replaced while a frame is matched; that frame keeps its grid. */

#ifndef LITESTEREO_RECTIFICATION_H
#define LITESTEREO_RECTIFICATION_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/calibration.h"
#include "litestereo/status.h"
#include "litestereo/stereo.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Handle of the rectification; read-only for the caller. */
typedef struct {
    uint16_t      rows;         /**< Rows of the raw images that gateware keeps; 0 if it has no rectification. */
    uint16_t      max_width;    /**< Widest frame that it rectifies, pixels. */
    uint16_t      max_height;   /**< Highest one. */
    calibration_t calibration;  /**< The calibration in use; its width is 0 without one. */
    uint8_t       grid;         /**< Grid that has it: of the jobs that are submitted from now on. */
    uint16_t      rows_needed;  /**< Rows that the calibration checked last needs; 0 before the first. */
    bool          checking;     /**< A calibration is being checked. */
    calibration_t candidate;    /**< That calibration, */
    row_budget_t  budget;       /**< and its rows, counted so far. */
} rectification_t;

/** Reads what the gateware of a matcher has; STATUS_UNSUPPORTED if it has no rectification. */
status_t rectification_init(rectification_t *rectification, const stereo_t *stereo);

/** Begins to check a calibration, and then uses it: call rectification_poll until it has ended. The record must stay as
 * it is, as long as the calibration is used.
 *
 * STATUS_BUSY until rectification_poll has ended an earlier one; STATUS_UNSUPPORTED without a rectification;
 * STATUS_BAD_ARGUMENT if the map folds over; STATUS_SIZE if gateware cannot rectify frames of the size; otherwise what
 * calibration_parse returns.
 */
status_t rectification_begin(rectification_t *rectification, const uint8_t *record, uint32_t size);

/** Does the next piece of the check, about a millisecond.
 *
 * STATUS_OK    the calibration is in use
 * STATUS_BUSY  not yet
 * STATUS_ROWS  it needs `rows_needed` rows, more than `rows`: the one before stays in use
 * STATUS_IDLE  none is being checked
 *
 * It is busy as well while a frame is matched with the grid that the calibration would replace.
 */
status_t rectification_poll(rectification_t *rectification);

/** Checks a calibration, uses it, and waits for that; feeds the watchdog meanwhile. Returns what rectification_begin and
 * rectification_poll do, but STATUS_TIMEOUT in place of STATUS_BUSY, if a frame does not end. */
status_t rectification_use(rectification_t *rectification, const uint8_t *record, uint32_t size);

/** Uses no calibration any more. */
void rectification_forget(rectification_t *rectification);

/** Whether a frame of this size can be rectified now. */
static inline bool rectification_fits(const rectification_t *rectification, uint32_t width, uint32_t height)
{
    return width != 0 && width == rectification->calibration.width && height == rectification->calibration.height;
}

#ifdef __cplusplus
}
#endif

#endif
