/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Rectification in software, pixel by pixel as docs/rectification.md defines it. */

#ifndef FAKE_RECTIFIER_H
#define FAKE_RECTIFIER_H

#include <stdint.h>

/** Rectifies the image of a camera by a grid of fake_grids: `raw` and `rectified` have width x height bytes. */
void fake_rectify(unsigned grid, unsigned camera, uint32_t width, uint32_t height, const uint8_t *raw, uint8_t *rectified);

#endif
