#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The spatial filter: smooth surfaces with their edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .disparity_map import DisparityMap
from .map_filter import MapFilter, parameter

#: The most pixels of a hole that are filled from each of its ends, by the number of `holes_fill`; None for all.
FILLED_PX = (0, 2, 4, 8, 16, None)


@dataclass(frozen=True)
class SpatialFilter(MapFilter):
    """Smooth along rows and columns, but not across edges, as librealsense's spatial edge-preserving filter.

    Each of `filter_magnitude` rounds goes along the rows, forward and back, and along the columns, forward and back. In
    each direction a pixel becomes alpha times itself plus 1 - alpha times the result of the pixel before it. It remains
    as it is where the two differed by `filter_smooth_delta` sixteenths of a pixel or more before the pass, and after a
    pixel without a disparity: nothing passes an edge or a hole. Between the passes disparities are real numbers
    (float32); the result is rounded to sixteenths once.

    Pixels without a disparity get none, unless `holes_fill` is above 0. Then, after the last round, the pixels of a
    hole in a row get the disparity at its left end, as many as `FILLED_PX` says, and those that remain get the one at
    its right end, as many again.

    After E. S. L. Gastal and M. M. Oliveira, Domain transform for edge-aware image and video processing, ACM
    Transactions on Graphics 30(4), 2011.
    """

    name = "spatial"
    text = "smooth surfaces with their edges, along rows and columns"

    filter_magnitude:    int   = parameter(2, 1, 5, "rounds")
    filter_smooth_alpha: float = parameter(0.5, 0.25, 1, "share of a pixel in its result, 1 for no smoothing")
    filter_smooth_delta: int   = parameter(20, 1, 50, "least step that is an edge, sixteenths of a pixel")
    holes_fill:          int   = parameter(0, 0, 5, "fill at most 0, 2, 4, 8, 16, all pixels from each end of a hole")

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the smooth map; `map_` remains as it is."""
        values, valid = map_.disparity.astype(np.float32), map_.valid
        # Along the rows is along the first axis of the transposed map: a step is a whole row of memory.
        along_rows = np.ascontiguousarray((valid[:, 1:] & valid[:, :-1]).T)
        along_columns = valid[1:] & valid[:-1]
        for _ in range(int(self.filter_magnitude)):
            values = self._both_ways(np.ascontiguousarray(values.T), along_rows).T
            values = self._both_ways(np.ascontiguousarray(values), along_columns)
        most = FILLED_PX[int(self.holes_fill)]
        if most != 0:
            values, valid = fill_from_left(values, valid, most)
            mirrored      = fill_from_left(values[:, ::-1], valid[:, ::-1], most)
            values, valid = mirrored[0][:, ::-1], mirrored[1][:, ::-1]
        return map_.with_values(values, valid)

    def _both_ways(self, lines: NDArray[np.float32], both: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Smooth along the first axis, forward and back, where `both` a line and the next one have a disparity."""
        return self._smooth(self._smooth(lines, both)[::-1], both[::-1])[::-1]

    def _smooth(self, lines: NDArray[np.float32], both: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Smooth along the first axis, forward."""
        joined = both & (np.abs(lines[1:] - lines[:-1]) < np.float32(self.filter_smooth_delta))
        # Shares of the line before in each line: 0 where none of it passes.
        shares = joined*(np.float32(1) - np.float32(self.filter_smooth_alpha))
        result = np.array(lines)
        result[1:] *= np.float32(1) - shares
        passed = np.empty(result.shape[1], np.float32)
        for share, before, line in zip(shares, result, result[1:], strict=False):
            np.multiply(share, before, out=passed)
            np.add(line, passed, out=line)
        return result


def fill_from_left(values: NDArray[np.float32], valid: NDArray[np.bool_], most: int | None
                   ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Fill the holes of rows with the value at their left end.

    Parameters
    ----------
    values, valid
        float32 and bool, H x W: disparities, and where there is one.
    most
        The most pixels of a hole that are filled; None for all.

    Returns
    -------
    Both after that. A hole at the left border has no left end and remains.
    """
    columns = np.arange(values.shape[1])
    last    = np.maximum.accumulate(np.where(valid, columns, -1), axis=1)
    filled  = last >= 0
    if most is not None:
        filled &= columns - last <= most
    rows = np.arange(values.shape[0])[:, np.newaxis]
    return np.where(filled, values[rows, np.maximum(last, 0)], values), filled
