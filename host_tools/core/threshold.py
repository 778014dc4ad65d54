#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The threshold filter: disparities of a range of depths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .disparity_map import DisparityMap
from .errors import GeometryError, SettingsError
from .map_filter import MapFilter, parameter
from .settings import DISPARITY_SCALE


@dataclass(frozen=True)
class ThresholdFilter(MapFilter):
    """Remove the disparities whose depth is less than `min_distance` or more than `max_distance`, in metres.

    A depth at a limit remains. The disparity of infinity, and those below it, are removed. Pixels without a disparity
    remain so, and the others as they are, to the sixteenth. It is librealsense's threshold filter.

    Raises
    ------
    SettingsError
        A limit is out of its range, or `min_distance` is above `max_distance`.
    GeometryError
        By `process`: the map has no cameras, without which there is no depth.
    """

    name = "threshold"
    text = "only depths from min_distance to max_distance"
    needs_geometry = True

    min_distance: float = parameter(0.1, 0, 16, "least depth, metres")
    max_distance: float = parameter(4.0, 0, 16, "largest depth, metres")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_distance > self.max_distance:
            raise SettingsError(f"min_distance of the filter threshold must be at most its max_distance, "
                                f"{self.max_distance:g}, not {self.min_distance:g}")

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the map with those depths alone; `map_` remains as it is."""
        geometry = map_.geometry
        if geometry is None:
            raise GeometryError("the filter threshold needs the cameras: without them there is no depth")
        above    = map_.disparity.astype(np.float64)/DISPARITY_SCALE - geometry.zero_px
        product  = geometry.focal_px*geometry.baseline_m # The depth is this, divided by `above`.
        inside   = (above > 0) & (product >= self.min_distance*above) & (product <= self.max_distance*above)
        return map_.with_values(map_.disparity.astype(np.float64), map_.valid & inside)
