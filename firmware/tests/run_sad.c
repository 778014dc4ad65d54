/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reads "width height disparities block_size" and two images from standard input, writes the map to standard output. */

#include <stdio.h>
#include <stdlib.h>

#include "app/sad.h"
#include "require.h"

int main(void)
{
    unsigned  width, height, disparities, block_size;
    uint8_t  *images;
    int16_t  *map;
    uint32_t *scratch;
    size_t    pixels;

    REQUIRE(scanf("%u %u %u %u", &width, &height, &disparities, &block_size) == 4 && getchar() == '\n');
    pixels  = (size_t)width * height;
    images  = malloc(2 * pixels);
    map     = malloc(pixels * sizeof(*map));
    scratch = malloc(SAD_SCRATCH_WORDS(width, height) * sizeof(*scratch));
    REQUIRE(fread(images, 1, 2 * pixels, stdin) == 2 * pixels);
    sad_match(images, images + pixels, width, height, disparities, block_size, map, scratch);
    REQUIRE(fwrite(map, sizeof(*map), pixels, stdout) == pixels);
    free(images);
    free(map);
    free(scratch);
    return 0;
}
