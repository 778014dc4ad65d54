/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Times the firmware's matcher on this computer: block matching alone, nothing but sums of absolute differences. What
 * counts is the processor's time, which does not depend on what else the computer does.
 *
 *   serial_sad <width> <height> <disparities> <block size> <frames>
 *
 * reads both images from standard input, and writes the shortest time of a frame, in nanoseconds and eight bytes, and
 * the map to standard output.
 */

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "reference/stereo_bm.h"

static uint64_t now_ns(void)
{
    struct timespec time;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

int main(int argc, char **argv)
{
    stereo_settings_t settings = {.disp12_max_diff = -1};
    uint64_t          shortest = UINT64_MAX;
    uint8_t          *images;
    int16_t          *map;
    uint32_t         *scratch;
    size_t            pixels;

    if (argc != 6) {
        return 1;
    }
    settings.width       = (uint16_t)atoi(argv[1]);
    settings.height      = (uint16_t)atoi(argv[2]);
    settings.disparities = (uint16_t)atoi(argv[3]);
    settings.block_size  = (uint8_t)atoi(argv[4]);
    pixels  = (size_t)settings.width * settings.height;
    images  = malloc(2 * pixels);
    map     = malloc(pixels * sizeof(*map));
    scratch = malloc(stereo_bm_scratch_words(&settings) * sizeof(*scratch));
    if (images == NULL || map == NULL || scratch == NULL || fread(images, 1, 2 * pixels, stdin) != 2 * pixels) {
        return 1;
    }
    for (int frame = 0; frame < atoi(argv[5]); frame++) {
        uint64_t begin = now_ns(), time;

        stereo_bm(&settings, images, images + pixels, map, scratch);
        time     = now_ns() - begin;
        shortest = time < shortest ? time : shortest;
    }
    if (fwrite(&shortest, sizeof(shortest), 1, stdout) != 1 || fwrite(map, sizeof(*map), pixels, stdout) != pixels) {
        return 1;
    }
    free(images);
    free(map);
    free(scratch);
    return 0;
}
