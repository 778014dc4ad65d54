/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reads the sizes of picture and map, disparities and minimum disparity, a number each, and the map from standard
 * input; writes the picture to standard output. */

#include <stdlib.h>

#include "litestereo/grey_map.h"
#include "require.h"

int main(void)
{
    unsigned          width, height, columns, rows, disparities, smallest;
    stereo_settings_t settings = {0};
    int16_t          *map;
    uint8_t          *picture;

    REQUIRE(scanf("%u %u %u %u %u %u", &width, &height, &columns, &rows, &disparities, &smallest) == 6);
    REQUIRE(getchar() == '\n');
    settings.width         = (uint16_t)columns;
    settings.height        = (uint16_t)rows;
    settings.disparities   = (uint16_t)disparities;
    settings.min_disparity = (uint8_t)smallest;
    map     = malloc((size_t)columns * rows * sizeof(*map));
    picture = malloc((size_t)width * height);
    REQUIRE(fread(map, sizeof(*map), (size_t)columns * rows, stdin) == (size_t)columns * rows);
    for (uint32_t row = 0; row < height; row++) {
        grey_map_row(&settings, map, picture + (size_t)row * width, width, height, row);
    }
    REQUIRE(fwrite(picture, width, height, stdout) == height);
    free(map);
    free(picture);
    return 0;
}
