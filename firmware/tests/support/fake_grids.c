/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_grids.h"

#include "generated/csr.h"

fake_grids_t fake_grids = {.rows = 64, .max_height = 480, .in_use = -1};

uint32_t stereo_rows_read(void)
{
    return fake_grids.rows | (uint32_t)fake_grids.max_height << 16;
}

uint32_t stereo_rectification_read(void)
{
    return fake_grids.flags | (fake_grids.lost ? 4u : 0u);
}

void stereo_place_write(uint32_t value)
{
    fake_grids.place = value;
    fake_grids.lost  = false;
}

void stereo_node_write(uint32_t value)
{
    unsigned node = fake_grids.place & 0xffff, grid = fake_grids.place >> 16 & 1, camera = fake_grids.place >> 17 & 1;

    fake_grids.size[grid] = 0;
    if (node >= FAKE_GRIDS_NODES || (int)grid == fake_grids.in_use) {
        fake_grids.lost = true;
    } else {
        fake_grids.node[grid][camera][node] = value;
    }
    fake_grids.place++;
}

void stereo_grid0_size_write(uint32_t value)
{
    fake_grids.size[0] = value;
}

void stereo_grid1_size_write(uint32_t value)
{
    fake_grids.size[1] = value;
}
