#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The decimation filter: fewer pixels, each made of several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .disparity_map import DisparityMap, check_size, decimated
from .map_filter import MapFilter, parameter

#: The largest factor whose pixels are medians; those of larger ones are means.
_LAST_MEDIAN = 3


@dataclass(frozen=True)
class DecimationFilter(MapFilter):
    """Make one pixel of `filter_magnitude` x `filter_magnitude` pixels, as librealsense's decimation filter.

    A pixel is the median of the disparities for magnitudes 2 and 3, and their mean from 4 on. Pixels without a
    disparity do not count: only where there is no other the result has none. Of an even number of disparities the
    median is the larger one of the two in the middle, which is nearer to the cameras. Rows and columns after the last
    whole pixel are cut off.

    The pixels of the result are larger, and what counts in pixels changes with them: disparities and their range, focal
    lengths and principal points. The result's `settings`, `geometry` and `factor` have them. Disparities are still in
    sixteenths of a pixel, and rounded to the nearest: at magnitude 4 a step is a quarter of a pixel of the images.

    Two things are not as in librealsense. It appends rows and columns without a depth until their numbers are multiples
    of 4. And it averages depths: disparities are averaged here, whose errors are equal near and far.

    Raises
    ------
    ImageError
        By `process`: the map has fewer rows or columns than the magnitude.
    """

    name = "decimation"
    text = "one pixel of several: their median (2, 3) or mean (from 4 on)"

    filter_magnitude: int = parameter(2, 2, 8, "rows and columns that become one")

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the smaller map, with `settings`, `geometry` and `factor` of its pixels; `map_` remains as it is."""
        factor = int(self.filter_magnitude)
        check_size(map_, factor)
        height, width = (size//factor for size in map_.disparity.shape)
        areas  = map_.disparity[:height*factor, :width*factor].reshape(height, factor, width, factor)
        areas  = areas.transpose(0, 2, 1, 3).reshape(height, width, factor*factor)
        valid  = areas > map_.settings.invalid
        counts = valid.sum(axis=2)
        if factor <= _LAST_MEDIAN:
            # Pixels without a disparity come last.
            ordered = np.sort(np.where(valid, areas, np.iinfo(np.int16).max), axis=2)
            middle  = np.take_along_axis(ordered, (counts//2)[:, :, np.newaxis], axis=2)[:, :, 0].astype(np.float64)
        else:
            middle  = np.where(valid, areas, 0).sum(axis=2, dtype=np.int64)/np.maximum(counts, 1)
        return decimated(map_, factor, middle, counts > 0)
