/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_rectifier.h"

#include "fake_grids.h"

/* Position of a pixel in an image of the camera, 32nds of a pixel: column for axis 0, row for axis 1. */
static int32_t position(const uint32_t *nodes, uint32_t columns, uint32_t x, uint32_t y, unsigned axis)
{
    const uint32_t *node = nodes + y / 16 * columns + x / 16;
    int32_t         n[4], left, right;

    for (unsigned i = 0; i < 4; i++) {
        n[i] = (int16_t)(node[i / 2 * columns + i % 2] >> 16 * axis);
    }
    left  = 16 * n[0] + (int32_t)(y % 16) * (n[2] - n[0]);
    right = 16 * n[1] + (int32_t)(y % 16) * (n[3] - n[1]);
    return ((16 * left + (int32_t)(x % 16) * (right - left) + 512) >> 10) + 32 * (int32_t)(axis == 0 ? x : y);
}

void fake_rectify(unsigned grid, unsigned camera, uint32_t width, uint32_t height, const uint8_t *raw, uint8_t *rectified)
{
    const uint32_t *nodes = fake_grids.node[grid][camera];

    for (uint32_t i = 0; i < width * height; i++) {
        int32_t u = position(nodes, (width - 1) / 16 + 2, i % width, i / width, 0);
        int32_t v = position(nodes, (width - 1) / 16 + 2, i % width, i / width, 1);
        int32_t total = 512;

        for (int32_t k = 0; k < 4; k++) {
            int32_t x = (u >> 5) + k % 2, y = (v >> 5) + k / 2;
            int32_t weight = (k % 2 != 0 ? u & 31 : 32 - (u & 31)) * (k / 2 != 0 ? v & 31 : 32 - (v & 31));

            if (x >= 0 && y >= 0 && x < (int32_t)width && y < (int32_t)height) {
                total += weight * raw[y * (int32_t)width + x];
            }
        }
        rectified[i] = (uint8_t)(total >> 10);
    }
}
