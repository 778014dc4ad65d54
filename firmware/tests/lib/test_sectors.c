/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Sectors against a definition that sorts, and distances. */

#include <stdlib.h>
#include <string.h>

#include "litestereo/depth.h"
#include "litestereo/sectors.h"
#include "require.h"

enum { WIDTH = 90, HEIGHT = 20 };

static stereo_settings_t settings = {
    .width = WIDTH, .height = HEIGHT, .disparities = 32, .block_size = 5, .min_disparity = 3,
};

static unsigned seed = 7;

static int16_t *new_map(void)
{
    int16_t *map = malloc(WIDTH * HEIGHT * sizeof(*map));

    for (unsigned i = 0; i < WIDTH * HEIGHT; i++) {
        map[i] = stereo_settings_invalid(&settings);
    }
    return map;
}

static int falling(const void *a, const void *b)
{
    return *(const int16_t *)b - *(const int16_t *)a;
}

/* The `least`-th largest valid value in these columns, and the number of valid ones. */
static uint32_t expected(const int16_t *map, uint32_t first, uint32_t columns, uint32_t least, int16_t *nearest)
{
    int16_t  values[WIDTH * HEIGHT];
    uint32_t count = 0;

    for (uint32_t row = 0; row < HEIGHT; row++) {
        for (uint32_t column = first; column < first + columns; column++) {
            if (disparity_is_valid(&settings, disparity_at(&settings, map, column, row))) {
                values[count++] = disparity_at(&settings, map, column, row);
            }
        }
    }
    qsort(values, count, sizeof(*values), falling);
    *nearest = count >= least ? values[least - 1] : stereo_settings_invalid(&settings);
    return count;
}

static void test_against_sorting(void)
{
    const uint32_t first = 3 + 31 + 2, end = WIDTH - 2;

    for (unsigned round = 0; round < 300; round++) {
        int16_t *map   = new_map();
        unsigned count = 1 + next_random(&seed) % 7;
        uint32_t least = 1 + next_random(&seed) % (round % 2 == 0 ? 20 : 400);
        uint32_t next  = first;
        sector_t sectors[7];

        for (uint32_t row = 2; row < HEIGHT - 2; row++) {
            for (uint32_t column = first; column < end; column++) {
                if (next_random(&seed) % 4 != 0) {
                    /* From the smallest disparity to the largest, both included. */
                    map[row * WIDTH + column] = (int16_t)(16 * 3 + next_random(&seed) % (16 * 31 + 1));
                }
            }
        }
        REQUIRE(sectors_find(&settings, map, least, sectors, count) == STATUS_OK);
        for (unsigned i = 0; i < count; i++) {
            int16_t nearest;

            /* Adjacent, and together all columns that can have a disparity. */
            REQUIRE(sectors[i].first == next && sectors[i].columns > 0);
            next += sectors[i].columns;
            REQUIRE(sectors[i].pixels == expected(map, sectors[i].first, sectors[i].columns, least, &nearest));
            REQUIRE(sectors[i].found == (sectors[i].pixels >= least) && sectors[i].disparity == nearest);
        }
        REQUIRE(next == end);
        free(map);
    }
}

/* A few mismatches neither hide a wall nor count as one. */
static void test_outliers(void)
{
    int16_t *map = new_map();
    sector_t sector;

    for (uint32_t row = 2; row < HEIGHT - 2; row++) {
        map[row * WIDTH + 50] = 10 * 16 + 5;
    }
    for (uint32_t i = 0; i < 4; i++) {
        map[(5 + i) * WIDTH + 60] = 30 * 16;
    }
    REQUIRE(sectors_find(&settings, map, 5, &sector, 1) == STATUS_OK);
    REQUIRE(sector.found && sector.disparity == 10 * 16 + 5 && sector.pixels == HEIGHT - 4 + 4);
    REQUIRE(sectors_find(&settings, map, 4, &sector, 1) == STATUS_OK && sector.disparity == 30 * 16);
    REQUIRE(sectors_find(&settings, map, HEIGHT + 1, &sector, 1) == STATUS_OK && !sector.found);
    free(map);
}

static void test_arguments(void)
{
    int16_t *map = new_map();
    sector_t sectors[60];

    REQUIRE(sectors_find(&settings, map, 0, sectors, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(sectors_find(&settings, map, 1, sectors, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(sectors_find(&settings, map, 1, NULL, 1) == STATUS_BAD_ARGUMENT);
    REQUIRE(sectors_find(&settings, map, 1, sectors, 52) == STATUS_OK);
    REQUIRE(sectors_find(&settings, map, 1, sectors, 53) == STATUS_SIZE);
    settings.width = 38;
    REQUIRE(sectors_find(&settings, map, 1, sectors, 1) == STATUS_SIZE);
    settings.width = 1;  /* Less than half a block. */
    REQUIRE(sectors_find(&settings, map, 1, sectors, 1) == STATUS_SIZE);
    settings.width  = WIDTH;
    settings.height = 4;
    REQUIRE(sectors_find(&settings, map, 1, sectors, 1) == STATUS_SIZE);
    settings.height = HEIGHT;
    free(map);
}

static void test_depth(void)
{
    const stereo_camera_t camera = {.focal_px16 = 500 * 16, .baseline_um = 60000};
    const stereo_camera_t large  = {.focal_px16 = UINT32_MAX, .baseline_um = UINT32_MAX};

    REQUIRE(depth_mm(&camera, 16) == 30000 && depth_mm(&camera, 32) == 15000 && depth_mm(&camera, 1) == 480000);
    REQUIRE(depth_mm(&camera, 7) == 68571 && depth_mm(&camera, 511 * 16) == 59);
    REQUIRE(depth_mm(&camera, 0) == DEPTH_FAR && depth_mm(&camera, -16) == DEPTH_FAR);
    REQUIRE(depth_mm(&large, 1) == DEPTH_FAR);
    REQUIRE(!disparity_is_valid(&settings, 32) && disparity_is_valid(&settings, 48));
}

int main(void)
{
    test_against_sorting();
    test_outliers();
    test_arguments();
    test_depth();
    return 0;
}
