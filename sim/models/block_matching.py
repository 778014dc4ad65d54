#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference model of the sum of absolute differences alone, in NumPy: what the gateware must return without stages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Fractional bits of a disparity: the map holds sixteenths of a pixel, as cv2.StereoBM's does.
DISPARITY_SHIFT = 4

#: Value of a pixel without a disparity: (min_disparity - 1) * 16 with a minimum disparity of 0.
INVALID = -16


def minimum_size(disparities: int, block_size: int) -> tuple[int, int]:
    """Return width and height in pixels of the smallest image that has one valid pixel."""
    return disparities + block_size - 1, block_size


def block_sums(difference: NDArray[np.uint8], block_size: int) -> NDArray[np.int32]:
    """Sum an image (uint8, H x W) over all whole blocks of `block_size` x `block_size` pixels, by cumulative sums.

    Returns
    -------
    int32, (H - block_size + 1) x (W - block_size + 1).
    """
    sums = difference.astype(np.int32)
    for axis in (0, 1):
        total = np.cumsum(sums, axis=axis, dtype=np.int32)
        total = np.insert(total, 0, 0, axis=axis)
        length = total.shape[axis]
        sums = (np.take(total, range(block_size, length), axis=axis)
              - np.take(total, range(length - block_size), axis=axis))
    return sums


def match(left: NDArray[np.uint8], right: NDArray[np.uint8], disparities: int, block_size: int) -> NDArray[np.int16]:
    """Match a rectified pair by the sum of absolute differences (SAD) of blocks.

    The rules are those of OpenCV's `cv2.StereoBM` without its prefilter and its validity tests: the
    smallest cost wins, and of equal costs the largest disparity.

    Parameters
    ----------
    left, right
        Rectified 8-bit grey images, H x W, of the same shape.
    disparities
        Number of disparities searched, 0 to `disparities` - 1 pixels.
    block_size
        Side of the block in pixels, odd.

    Returns
    -------
    int16, H x W, in sixteenths of a pixel; `INVALID` outside of rows [k, H - k) and columns
    [disparities - 1 + k, W - k), where k = block_size // 2.

    Raises
    ------
    ValueError
        The images differ in shape or type, or are too small to have a valid pixel.
    """
    if left.shape != right.shape or left.ndim != 2:
        raise ValueError(f"two grey images of one size are needed, not {left.shape} and {right.shape}")
    if left.dtype != np.uint8 or right.dtype != np.uint8:
        raise ValueError(f"8-bit images are needed, not {left.dtype} and {right.dtype}")
    height, width = left.shape
    min_width, min_height = minimum_size(disparities, block_size)
    if width < min_width or height < min_height:
        raise ValueError(f"{width}x{height} is too small for {disparities} disparities and block size {block_size}: "
                         f"at least {min_width}x{min_height} is needed")

    margin      = block_size // 2
    first       = disparities - 1
    left_part   = left[:, first:].astype(np.int16)
    best_cost   = np.full((height - 2*margin, width - first - 2*margin), np.iinfo(np.int32).max, np.int32)
    best        = np.zeros_like(best_cost)
    for disparity in reversed(range(disparities)):
        right_part = right[:, first - disparity:width - disparity].astype(np.int16)
        cost       = block_sums(np.abs(left_part - right_part).astype(np.uint8), block_size)
        better     = cost < best_cost
        best_cost  = np.where(better, cost, best_cost)
        best       = np.where(better, disparity, best)

    result = np.full((height, width), INVALID, np.int16)
    result[margin:height - margin, first + margin:width - margin] = best << DISPARITY_SHIFT
    return result
