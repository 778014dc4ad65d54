#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The speckle filter, which runs on the host: it removes small islands of disparities."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .errors import SettingsError
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
