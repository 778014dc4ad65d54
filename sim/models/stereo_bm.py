#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference model of the full matcher: the disparity map of `cv2.StereoBM`, pixel for pixel, in NumPy.

This holds in the valid region. Outside of it the model is invalid everywhere, while OpenCV 5.0 with a smallest
disparity above 0 writes `min_disparity` values past the end of each row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import stages
from .block_matching import DISPARITY_SHIFT
from .settings import Settings

#: Largest number of costs in memory at a time.
_MAX_COSTS = 1 << 24


def check_settings(settings: Settings) -> None:
    """Raise ValueError if `cv2.StereoBM` refuses a value, or if the prefilter is unknown."""
    for condition, message in (
        (settings.disparities > 0 and settings.disparities % 16 == 0,  "disparities must be 16, 32, 48, ..."),
        (5 <= settings.block_size <= 255 and settings.block_size % 2,  "block_size must be odd, from 5 to 255"),
        (settings.prefilter in ("xsobel", "none"),                     "prefilter must be xsobel or none"),
        (1 <= settings.prefilter_cap <= 63,                            "prefilter_cap must be from 1 to 63"),
        (settings.texture_threshold >= 0,                              "texture_threshold must not be below 0"),
        (settings.uniqueness_ratio >= 0,                               "uniqueness_ratio must not be below 0"),
    ):
        if not condition:
            raise ValueError(f"{message}: {settings}")


def invalid_value(settings: Settings) -> int:
    """Return the value of a pixel without a disparity, in sixteenths of a pixel."""
    return (settings.min_disparity - 1) << DISPARITY_SHIFT


def minimum_size(settings: Settings) -> tuple[int, int]:
    """Return width and height in pixels of the smallest image that has one pixel with a disparity.

    `cv2.StereoBM` requires one row more, although its result does not depend on it.
    """
    return max(settings.min_disparity + settings.disparities - 1, 0) + settings.block_size, settings.block_size


def used_columns(width: int, settings: Settings) -> stages.Columns:
    """Return the columns of an image of that width that take part."""
    return stages.Columns(width, settings.disparities, settings.min_disparity, settings.block_size)


def stereo_bm(left: NDArray[np.uint8], right: NDArray[np.uint8],
              settings: Settings) -> NDArray[np.int16]:
    """Match a rectified pair.

    Parameters
    ----------
    left, right
        Rectified 8-bit grey images, H x W, of the same shape.
    settings
        Settings of the match.

    Returns
    -------
    int16, H x W, in sixteenths of a pixel; `invalid_value(settings)` where there is no disparity, which is
    everywhere in an image that is too narrow.

    Raises
    ------
    ValueError
        The images differ in shape or type, or are smaller than a block, or `check_settings` refuses the settings.
    """
    check_settings(settings)
    if left.shape != right.shape or left.ndim != 2:
        raise ValueError(f"two grey images of one size are needed, not {left.shape} and {right.shape}")
    if left.dtype != np.uint8 or right.dtype != np.uint8:
        raise ValueError(f"8-bit images are needed, not {left.dtype} and {right.dtype}")
    height, width = left.shape
    margin        = settings.block_size // 2
    invalid       = invalid_value(settings)
    if min(height, width) < settings.block_size:
        raise ValueError(f"{width}x{height} pixels are less than a block of {settings.block_size}")
    result  = np.full((height, width), invalid, np.int16)
    columns = used_columns(width, settings)
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
    result[:, :columns.valid.start] = invalid
    result[:, columns.valid.stop:]  = invalid
    return stages.median3x3(result) if settings.median else result


def _match_rows(left: NDArray[np.uint8], right: NDArray[np.uint8], settings: Settings,
                columns: stages.Columns) -> NDArray[np.int16]:
    """Return the disparities of all rows that have a whole block, in the columns that have a cost."""
    invalid     = np.int16(invalid_value(settings))
    costs       = stages.block_costs(left, right, columns)
    index, cost = stages.winners(costs)
    if settings.subpixel:
        disparity = stages.subpixel(costs, index, settings.min_disparity)
    else:
        disparity = ((settings.min_disparity + index) << DISPARITY_SHIFT).astype(np.int16)
    valid = stages.uniqueness_mask(costs, index, settings.uniqueness_ratio)
    if settings.prefilter == "xsobel":
        valid &= stages.texture_sums(left, settings.prefilter_cap, columns) >= settings.texture_threshold
    disparity = np.where(valid, disparity, invalid)
    kept      = stages.left_right_check(disparity, cost, settings.disp12_max_diff, columns)
    return np.where(kept, disparity, invalid)
