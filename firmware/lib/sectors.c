/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/sectors.h"

#include <stddef.h>
#include <string.h>

#include "litestereo/depth.h"

/* Sixteenths of a pixel in a pixel: bins of the second pass over the map. */
#define FINE       16u
#define FINE_SHIFT 4u

/* Most disparities in whole pixels: bins of the first pass. */
#define COARSE 256u

/* Counts the disparities of a sector in bins of 2**`shift` sixteenths of a pixel, from `base` on. Those above the last
 * bin are not counted. */
static void count_disparities(const stereo_settings_t *settings, const int16_t *map, const sector_t *sector,
    int32_t base, uint32_t shift, uint32_t *bins, uint32_t count)
{
    uint32_t margin = settings->block_size / 2u;

    memset(bins, 0, count * sizeof(*bins));
    for (uint32_t row = margin; row < settings->height - margin; row++) {
        const int16_t *pixel = map + row * settings->width + sector->first;
        const int16_t *end   = pixel + sector->columns;

        for (; pixel < end; pixel++) {
            uint32_t bin = (uint32_t)(*pixel - base) >> shift;

            if (*pixel >= base && bin < count) {
                bins[bin]++;
            }
        }
    }
}

/* Largest bin that together with the bins above it has at least `least` counts; subtracts the counts above it from
 * `least`. */
static uint32_t find_bin(const uint32_t *bins, uint32_t count, uint32_t *least)
{
    uint32_t bin = count - 1;

    for (; bin > 0 && bins[bin] < *least; bin--) {
        *least -= bins[bin];
    }
    return bin;
}

static void find(const stereo_settings_t *settings, const int16_t *map, uint32_t least, sector_t *sector)
{
    /* The value of a pixel without a disparity is smaller. */
    int32_t  base = settings->min_disparity * (int32_t)FINE;
    uint32_t bins[COARSE];
    uint32_t coarse;

    count_disparities(settings, map, sector, base, FINE_SHIFT, bins, COARSE);
    sector->pixels = 0;
    for (uint32_t bin = 0; bin < COARSE; bin++) {
        sector->pixels += bins[bin];
    }
    sector->found     = sector->pixels >= least;
    sector->disparity = stereo_settings_invalid(settings);
    if (!sector->found) {
        return;
    }
    coarse = find_bin(bins, COARSE, &least);
    base  += (int32_t)(coarse * FINE);
    count_disparities(settings, map, sector, base, 0, bins, FINE);
    sector->disparity = (int16_t)(base + (int32_t)find_bin(bins, FINE, &least));
}

status_t sectors_find(const stereo_settings_t *settings, const int16_t *map, uint32_t least, sector_t *sectors,
    unsigned count)
{
    uint32_t margin = settings->block_size / 2u;
    uint32_t first  = settings->min_disparity + settings->disparities - 1u + margin;
    uint32_t end    = settings->width > margin ? settings->width - margin : 0;

    if (sectors == NULL || count == 0 || least == 0) {
        return STATUS_BAD_ARGUMENT;
    }
    if (end < first + count || settings->height < settings->block_size) {
        return STATUS_SIZE;
    }
    for (unsigned i = 0; i < count; i++) {
        uint32_t from = first + (end - first) * i / count;
        uint32_t to   = first + (end - first) * (i + 1) / count;

        sectors[i] = (sector_t){.first = (uint16_t)from, .columns = (uint16_t)(to - from)};
        find(settings, map, least, &sectors[i]);
    }
    return STATUS_OK;
}
