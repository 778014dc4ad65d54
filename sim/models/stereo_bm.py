#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference model of the full matcher: the disparity map of `cv2.StereoBM`, pixel for pixel, in NumPy.

This holds in the valid region. Outside of it the model is invalid everywhere, while OpenCV 5.0 with a smallest
disparity above 0 writes `min_disparity` values past the end of each row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import stages
from .block_matching import DISPARITY_SHIFT

#: Largest number of costs in memory at a time.
_MAX_COSTS = 1 << 24


@dataclass(frozen=True)
class StereoSettings:
    """Settings of a match: the parameters of `cv2.StereoBM` with its defaults, and a few more.

    Parameters
    ----------
    disparities
        Number of disparities searched, a multiple of 16.
    block_size
        Side of the block in pixels, odd, 5 to 255.
    min_disparity
        Smallest disparity searched, in pixels.
    prefilter
        "xsobel", or "none" for the grey values as they are, which have no texture test.
    prefilter_cap
        Largest slope that the prefilter keeps, 1 to 63.
    texture_threshold
        Least sum of slopes in a block.
    uniqueness_ratio
        Percent by which the cost of any other disparity must be larger; 0 for no test.
    disp12_max_diff
        Largest difference in the left-right check, in pixels; negative for no check.
    subpixel
        Whether the map has fractions of a pixel.
    median
        Whether a 3x3 median is the last step.

    Raises
    ------
    ValueError
        A value that `cv2.StereoBM` refuses, or an unknown prefilter.
    """

    disparities:       int  = 64
    block_size:        int  = 21
    min_disparity:     int  = 0
    prefilter:         str  = "xsobel"
    prefilter_cap:     int  = 31
    texture_threshold: int  = 10
    uniqueness_ratio:  int  = 15
    disp12_max_diff:   int  = -1
    subpixel:          bool = True
    median:            bool = False

    def __post_init__(self) -> None:
        for condition, message in (
            (self.disparities > 0 and self.disparities % 16 == 0, "disparities must be 16, 32, 48, ..."),
            (5 <= self.block_size <= 255 and self.block_size % 2, "block_size must be odd, from 5 to 255"),
            (self.prefilter in ("xsobel", "none"),                "prefilter must be xsobel or none"),
            (1 <= self.prefilter_cap <= 63,                       "prefilter_cap must be from 1 to 63"),
            (self.texture_threshold >= 0,                         "texture_threshold must not be below 0"),
            (self.uniqueness_ratio >= 0,                          "uniqueness_ratio must not be below 0"),
        ):
            if not condition:
                raise ValueError(f"{message}: {self}")

    @property
    def invalid(self) -> int:
        """Value of a pixel without a disparity, in sixteenths of a pixel."""
        return (self.min_disparity - 1) << DISPARITY_SHIFT

    @property
    def minimum_size(self) -> tuple[int, int]:
        """Width and height in pixels of the smallest image that has one pixel with a disparity.

        `cv2.StereoBM` requires one row more, although its result does not depend on it.
        """
        return max(self.min_disparity + self.disparities - 1, 0) + self.block_size, self.block_size

    def columns(self, width: int) -> stages.Columns:
        """Return the columns that take part, of an image of that width."""
        return stages.Columns(width, self.disparities, self.min_disparity, self.block_size)


def stereo_bm(left: NDArray[np.uint8], right: NDArray[np.uint8],
              settings: StereoSettings) -> NDArray[np.int16]:
    """Match a rectified pair.

    Parameters
    ----------
    left, right
        Rectified 8-bit grey images, H x W, of the same shape.
    settings
        Settings of the match.

    Returns
    -------
    int16, H x W, in sixteenths of a pixel; `settings.invalid` where there is no disparity, which is everywhere in an
    image that is too narrow.

    Raises
    ------
    ValueError
        The images differ in shape or type, or are smaller than a block.
    """
    if left.shape != right.shape or left.ndim != 2:
        raise ValueError(f"two grey images of one size are needed, not {left.shape} and {right.shape}")
    if left.dtype != np.uint8 or right.dtype != np.uint8:
        raise ValueError(f"8-bit images are needed, not {left.dtype} and {right.dtype}")
    height, width = left.shape
    margin        = settings.block_size // 2
    if min(height, width) < settings.block_size:
        raise ValueError(f"{width}x{height} pixels are less than a block of {settings.block_size}")
    result  = np.full((height, width), settings.invalid, np.int16)
    columns = settings.columns(width)
    if columns.valid.start >= columns.valid.stop or columns.count < 1:
        return result
    if settings.prefilter == "xsobel":
        left, right = (stages.prefilter_xsobel(image, settings.prefilter_cap) for image in (left, right))
    # Rows are independent. A band of a few rows at a time bounds the memory.
    rows = max(1, _MAX_COSTS // (columns.count*settings.disparities))
    for begin in range(margin, height - margin, rows):
        end   = min(begin + rows, height - margin)
        band  = slice(begin - margin, end + margin)
        found = _match_rows(left[band], right[band], settings, columns)
        result[begin:end, columns.first:columns.first + columns.count] = found
    result[:, :columns.valid.start] = settings.invalid
    result[:, columns.valid.stop:]  = settings.invalid
    return stages.median3x3(result) if settings.median else result


def _match_rows(left: NDArray[np.uint8], right: NDArray[np.uint8], settings: StereoSettings,
                columns: stages.Columns) -> NDArray[np.int16]:
    """Return the disparities of all rows that have a whole block, in the columns that have a cost."""
    costs       = stages.block_costs(left, right, columns)
    index, cost = stages.winners(costs)
    if settings.subpixel:
        disparity = stages.subpixel(costs, index, settings.min_disparity)
    else:
        disparity = ((settings.min_disparity + index) << DISPARITY_SHIFT).astype(np.int16)
    valid = stages.uniqueness_mask(costs, index, settings.uniqueness_ratio)
    if settings.prefilter == "xsobel":
        valid &= stages.texture_sums(left, settings.prefilter_cap, columns) >= settings.texture_threshold
    disparity = np.where(valid, disparity, np.int16(settings.invalid))
    kept      = stages.left_right_check(disparity, cost, settings.disp12_max_diff, columns)
    return np.where(kept, disparity, np.int16(settings.invalid))
