/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A map's rows in a picture: their places and their brightness. tests/firmware/test_grey_map.py has any sizes. */

#include "litestereo/grey_map.h"

#include <string.h>

#include "require.h"

static void test_values(void)
{
    static const struct {
        int16_t disparity;
        uint8_t grey;
    } expected[] = {
        {-16, 0}, {-32768, 0}, {-1, 0}, {0, 0}, {1, 1}, {120, 128}, {119, 126}, {239, 254}, {240, 255}, {248, 255},
        {32767, 255},
    };
    stereo_settings_t settings = {.width = 1, .height = 1, .disparities = 16};

    for (size_t i = 0; i < sizeof(expected) / sizeof(expected[0]); i++) {
        uint8_t out = 77;

        REQUIRE(grey_map_row(&settings, &expected[i].disparity, &out, 1, 1, 0) == 1);
        REQUIRE(out == expected[i].grey);
    }
}

/* With a minimum disparity the invalid value may be above 0, and the largest disparity is greater. */
static void test_smallest_disparity(void)
{
    static const int16_t map[]    = {144, 160, 400, 145};
    stereo_settings_t    settings = {.width = 4, .height = 1, .disparities = 16, .min_disparity = 10};
    uint8_t              out[4];

    REQUIRE(grey_map_row(&settings, map, out, 4, 1, 0) == 4);
    REQUIRE(out[0] == 0 && out[1] == 102 && out[2] == 255 && out[3] == 92);
}

/* Of `columns` x `rows` pixels, a disparity of 15 for each but those of the last row and column. */
static void test_place(uint16_t columns, uint16_t rows)
{
    int16_t           map[8 * 8];
    uint8_t           out[5 * 5 + 1];
    stereo_settings_t settings = {.width = columns, .height = rows, .disparities = 16};
    unsigned          lit = 0;

    for (unsigned i = 0; i < 8 * 8u; i++) {
        map[i] = i < (unsigned)columns * rows ? (int16_t)(i + 16) : 30000;
    }
    memset(out, 99, sizeof(out));
    for (uint32_t row = 0; row < 5; row++) {
        lit += grey_map_row(&settings, map, out + 5 * row, 5, 5, row);
    }
    REQUIRE(out[5 * 5] == 99);
    REQUIRE(lit == (columns < 5u ? columns : 5u) * (rows < 5u ? rows : 5u));
    for (int row = 0; row < 5; row++) {
        for (int column = 0; column < 5; column++) {
            /* Halves are rounded down on either side. */
            int x = column + (columns > 5 ? (columns - 5) / 2 : -((5 - columns) / 2));
            int y = row + (rows > 5 ? (rows - 5) / 2 : -((5 - rows) / 2));
            int d = x >= 0 && x < columns && y >= 0 && y < rows ? y * columns + x + 16 : 0;

            REQUIRE(out[5 * row + column] == (uint8_t)((d * (255 * 65536 / 240) + 32768) / 65536));
        }
    }
}

int main(void)
{
    test_values();
    test_smallest_disparity();
    for (uint16_t columns = 1; columns <= 8; columns++) {
        for (uint16_t rows = 1; rows <= 8; rows++) {
            test_place(columns, rows);
        }
    }
    return 0;
}
