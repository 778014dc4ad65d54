#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The hole filling filter: each pixel without a disparity gets one of its neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .disparity_map import DisparityMap
from .map_filter import MapFilter, parameter
from .spatial import fill_from_left

#: Numbers of `holes_fill`.
FILL_FROM_LEFT, FAREST_FROM_AROUND, NEAREST_FROM_AROUND = range(3)

#: More than the difference of any two disparities, in sixteenths of a pixel.
_APART = 1 << 17


@dataclass(frozen=True)
class HoleFillingFilter(MapFilter):
    """Give pixels without a disparity that of a neighbour, as librealsense's hole filling filter.

    By `holes_fill` it is the left neighbour (0), or the one that is farthest from the cameras (1), or nearest to them
    (2), among the neighbours above, above left, left, below left and below. The farthest one has the smallest
    disparity. Rows are filled from the top down, and each from left to right. A pixel that is filled is a neighbour of
    those that follow, so holes of any size are filled. The row below is as it was. What has no such neighbour remains
    without a disparity: for 0 the left border of the map. All other pixels remain as they are, to the sixteenth.

    Filled pixels are guesses. In the part of the left image that the right camera does not see, the farthest neighbour
    is the likely one.

    Two things are not as in librealsense. It leaves the first and the last row, and the first column, as they are for 1
    and 2. And for 2 it fills only below a pixel that has a depth.
    """

    name = "hole_filling"
    text = "each hole with a neighbour's disparity"

    holes_fill: int = parameter(FAREST_FROM_AROUND, 0, 2, "which neighbour: 0 left (fill_from_left), 1 farthest "
                                                          "(farest_from_around), 2 nearest (nearest_from_around)")

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the map with filled holes; `map_` remains as it is."""
        valid = map_.valid
        if self.holes_fill == FILL_FROM_LEFT:
            return map_.with_values(*fill_from_left(map_.disparity.astype(np.float32), valid, None))
        # The farthest one is the largest one of the negated disparities.
        sign   = -1 if self.holes_fill == FAREST_FROM_AROUND else 1
        none   = -_APART
        values = np.where(valid, sign*map_.disparity.astype(np.int64), none)
        for row in range(len(values)):
            if not valid[row].all():
                values[row] = _filled(values, row, valid[row])
        return map_.with_values(sign*values.astype(np.float64), values > none)


def _filled(values: NDArray[np.int64], row: int, valid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return a row whose holes have the largest value around, if the rows above it are filled.

    A value is an int64, and `-_APART` where there is none.
    """
    best = np.where(valid, values[row], -_APART)
    for other in (row - 1, row + 1):
        if 0 <= other < len(values):
            around     = values[other].copy()
            around[1:] = np.maximum(around[1:], values[other][:-1])
            best       = np.where(valid, best, np.maximum(best, around))
    # From left to right: a filled pixel is the left neighbour of the next one. A pixel that had a disparity begins a
    # segment; segments are lifted above those before them, so that a maximum does not reach past its beginning.
    segments = np.cumsum(valid)*(2*_APART)
    return np.asarray(np.maximum.accumulate(best + segments) - segments)
