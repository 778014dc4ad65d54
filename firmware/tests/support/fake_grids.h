/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The grids of the rectification in software, as functions of the stub csr.h. */

#ifndef FAKE_GRIDS_H
#define FAKE_GRIDS_H

#include <stdbool.h>
#include <stdint.h>

#define FAKE_GRIDS_NODES 2048u

/** Tests may change the first members. */
typedef struct {
    uint16_t rows;        /**< Rows that the gateware keeps. */
    uint16_t max_height;  /**< Rows of the highest frame. */
    int      in_use;      /**< Grid of the frame under way; -1 for none. */
    uint32_t size[2];     /**< Size of each grid, as in the register. */
    uint32_t node[2][2][FAKE_GRIDS_NODES];  /**< By grid and camera. */
    uint32_t place;       /**< Where the next node belongs. */
    bool     lost;        /**< A node was dropped. */
    uint32_t flags;       /**< Of the last frame. */
} fake_grids_t;

/** The only ones. */
extern fake_grids_t fake_grids;

#endif
