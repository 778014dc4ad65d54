#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification in integers: `cv2.remap` with a fixed-point map, whose bits are those of every OpenCV and of a device.

With float maps OpenCV 5 interpolates in another way than OpenCV 4. So nothing else in this project calls `cv2.remap`.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.grid import ONE, Grid
from .float_maps import FloatMaps, Mask

#: A position so little outside of an image counts as inside: there a pixel keeps seven eighths of its value, and a grid
#: is off by about as much. In 32nds of a pixel.
_EDGE = ONE//8

#: An image of any depth: H x W, or H x W x 3.
Image = NDArray[Any]


@dataclass(frozen=True, eq=False)
class FixedMap:
    """Where each rectified pixel is in a camera's image, as OpenCV has it.

    Parameters
    ----------
    whole
        Column and row, rounded down: int16, H x W x 2, in pixels.
    fractions
        32*row + column of the rest: uint16, H x W, in 32nds of a pixel.
    """

    whole:     NDArray[np.int16]
    fractions: NDArray[np.uint16]

    @classmethod
    def of_pixels(cls, maps: FloatMaps) -> FixedMap:
        """Return the map with the positions of each pixel, rounded to 32nds."""
        whole, fractions = cv2.convertMaps(*maps, cv2.CV_16SC2)
        return cls(np.asarray(whole, np.int16), np.asarray(fractions, np.uint16))

    @classmethod
    def of_grid(cls, grid: Grid) -> FixedMap:
        """Return the map that a device makes of a grid."""
        return cls(*grid.opencv_maps())

    def remap(self, image: Image) -> Image:
        """Return the rectified image, of the type of the camera's; what is outside of that is black."""
        return np.asarray(cv2.remap(image, self.whole, self.fractions, cv2.INTER_LINEAR))

    @functools.cached_property
    def covered(self) -> Mask:
        """Which rectified pixels are inside of the camera's image, which has the same size: bool, H x W."""
        height, width = self.fractions.shape
        column        = ONE*self.whole[..., 0].astype(np.int32) + (self.fractions & ONE - 1)
        row           = ONE*self.whole[..., 1].astype(np.int32) + (self.fractions >> 5)
        return np.asarray((column >= -_EDGE) & (column <= ONE*(width - 1) + _EDGE)
                          & (row >= -_EDGE) & (row <= ONE*(height - 1) + _EDGE), np.bool_)
