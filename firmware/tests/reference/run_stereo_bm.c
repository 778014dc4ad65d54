/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reads the settings, a number each, and two images from standard input; writes the map to standard output. */

#include <stdio.h>
#include <stdlib.h>

#include "reference/stereo_bm.h"
#include "require.h"

int main(void)
{
    static const stereo_limits_t limits = {
        .max_disparities = 256, .min_block_size = 5, .max_block_size = 255, .features = UINT32_MAX,
    };
    stereo_settings_t            settings = {0};
    unsigned                     width, height;
    uint8_t                     *images;
    int16_t                     *map;
    uint32_t                    *scratch;
    size_t                       pixels;

    REQUIRE(scanf("%u %u", &width, &height) == 2);
    settings.width  = (uint16_t)width;
    settings.height = (uint16_t)height;
    for (stereo_field_t field = STEREO_FIELD_FIRST; field <= STEREO_FIELD_LAST; field++) {
        int value;

        REQUIRE(scanf("%d", &value) == 1);
        REQUIRE(stereo_settings_set(&settings, &limits, field, value) == STATUS_OK);
    }
    REQUIRE(getchar() == '\n');
    pixels  = (size_t)width * height;
    images  = malloc(2 * pixels);
    map     = malloc(pixels * sizeof(*map));
    scratch = malloc(stereo_bm_scratch_words(&settings) * sizeof(*scratch));
    REQUIRE(fread(images, 1, 2 * pixels, stdin) == 2 * pixels);
    stereo_bm(&settings, images, images + pixels, map, scratch);
    REQUIRE(fwrite(map, sizeof(*map), pixels, stdout) == pixels);
    free(images);
    free(map);
    free(scratch);
    return 0;
}
