#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The speckle filter, which runs on the host: it removes small islands of disparities."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .disparity_map import DisparityMap
from .errors import SettingsError
from .map_filter import MapFilter, parameter
from .settings import MatcherSettings

#: Largest window; OpenCV counts pixels in a signed 32-bit integer.
_MAX_SIZE = 1 << 30


@dataclass(frozen=True)
class SpeckleFilter:
    """`cv2.filterSpeckles` as `cv2.StereoBM` uses it.

    Parameters
    ----------
    window
        Size in pixels of the largest island that is removed; 0 for no filter.
    range
        Largest difference between neighbours of one island, in sixteenths of a pixel; negative for no filter.

    Raises
    ------
    SettingsError
        The window is negative or above 2^30.
    """

    window: int = 0
    range:  int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.window <= _MAX_SIZE:
            raise SettingsError(f"the speckle window must be a number of pixels from 0 on, not {self.window}")

    def apply(self, disparity: NDArray[np.int16], settings: MatcherSettings) -> NDArray[np.int16]:
        """Return a copy of a map (int16, H x W, sixteenths of a pixel, matched with `settings`) without islands."""
        filtered: NDArray[np.int16] = disparity.copy()
        if self.window > 0 and self.range >= 0:
            cv2.filterSpeckles(filtered, settings.invalid, self.window, self.range)
        return filtered


@dataclass(frozen=True)
class SpeckleMapFilter(MapFilter):
    """Remove islands of disparities, as `SpeckleFilter`, at any place among other filters.

    An island is a set of pixels, next to each other in rows and columns, whose disparities differ from neighbour to
    neighbour by at most `range` sixteenths of a pixel. One of `window` pixels or less is removed: its pixels have no
    disparity afterwards. The others remain as they are, to the sixteenth. librealsense has no such filter; the defaults
    are what OpenCV recommends for `StereoSGBM`, a range of a pixel among them.
    """

    name = "speckle"
    text = "remove islands of few pixels"

    window: int = parameter(100, 1, _MAX_SIZE, "size of the largest island that is removed, pixels")
    range:  int = parameter(16, 0, 32767, "largest step within an island, sixteenths of a pixel")

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the map without islands; `map_` remains as it is."""
        filtered = SpeckleFilter(self.window, self.range).apply(map_.disparity, map_.settings)
        return dataclasses.replace(map_, disparity=filtered)
