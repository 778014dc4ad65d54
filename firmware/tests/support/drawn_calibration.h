/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Calibrations for tests. */

#ifndef DRAWN_CALIBRATION_H
#define DRAWN_CALIBRATION_H

#include <stdint.h>

#include "litestereo/calibration.h"

/** Most bytes of a drawn calibration. */
#define DRAWN_CALIBRATION_MOST 20224u

/** Writes the calibration of two cameras whose images are displaced by whole pixels; returns its bytes. */
uint32_t draw_calibration(uint8_t *record, uint16_t width, uint16_t height, int left_rows, int right_rows);

/** Makes the checksums of a calibration right. */
void seal_calibration(uint8_t *record, uint32_t size);

/** Changes a node of a calibration, and its checksums. */
void set_calibration_node(uint8_t *record, uint32_t size, unsigned camera, uint32_t node, int16_t column, int16_t row);

#endif
