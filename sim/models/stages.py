#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference models of the matcher's stages in NumPy: what each of them must return, number for number.

Together they are `cv2.StereoBM`; `stereo_bm.py` puts them together. Arrays of costs are disparities x rows
x columns, the smallest disparity first. Their rows are those that have a whole block, [k, H - k) with
k = block_size // 2. Their columns are those of `Columns`: the columns that have a whole block, and k more on either
side, which take part in the left-right check and are discarded after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .block_matching import DISPARITY_SHIFT, block_sums

#: Cost of a disparity that must not win: larger than that of any block.
NO_COST = np.iinfo(np.int32).max


@dataclass(frozen=True)
class Columns:
    """Which columns of an image get a cost, and from which pixels.

    Parameters
    ----------
    width
        Columns of the image.
    disparities, min_disparity, block_size
        Settings of the matcher.
    """

    width:         int
    disparities:   int
    min_disparity: int
    block_size:    int

    @property
    def first(self) -> int:
        """First column of the left image for which all disparities lie in the right image."""
        return max(self.min_disparity + self.disparities - 1, 0)

    @property
    def right_first(self) -> int:
        """First column of the right image that is used; not 0 only if all disparities are negative."""
        return -min(self.min_disparity + self.disparities - 1, 0)

    @property
    def count(self) -> int:
        """Columns that get a cost; 0 or less if the image is too narrow for any."""
        return min(self.width - self.right_first - self.disparities + 1, self.width - self.first)

    @property
    def valid(self) -> slice:
        """Columns of the map that can have a disparity: the others lack a part of their block."""
        margin = self.block_size // 2
        return slice(self.first + margin, max(self.first, self.width - margin))

    def left(self) -> NDArray[np.intp]:
        """Return the columns of the left image under the blocks, from k before `first` on, clipped to the image."""
        return np.clip(self.first + self._steps(), 0, self.width - 1)

    def right(self, disparity: int) -> NDArray[np.intp]:
        """Return the columns of the right image under the same blocks, at a disparity.

        All disparities of a block's column are clipped to the image together: at the ends of a row a column of the
        right image is not always that of the left image minus the disparity.
        """
        last = self.min_disparity + self.disparities - 1
        base = np.clip(self.right_first + self._steps(), 0, self.width - self.disparities)
        return base + (last - disparity)

    def _steps(self) -> NDArray[np.intp]:
        margin = self.block_size // 2
        return np.arange(-margin, self.count + margin)


def prefilter_xsobel(image: NDArray[np.uint8], cap: int) -> NDArray[np.uint8]:
    """Filter an image by a horizontal 3x3 Sobel, clipped to +-`cap` and shifted to 0 to 2*`cap`: uint8, H x W.

    Rows are mirrored at the edges: the second row is above the first, the last but one below the last. The first and
    the last column are `cap`. So is the last row if the number of rows is odd: OpenCV filters two rows at a time.
    """
    rows     = np.pad(image.astype(np.int32), ((1, 1), (0, 0)), mode="reflect")
    smooth   = rows[:-2] + 2*rows[1:-1] + rows[2:]
    filtered = np.full(image.shape, cap, np.uint8)
    filtered[:, 1:-1] = np.clip(smooth[:, 2:] - smooth[:, :-2], -cap, cap) + cap
    if len(image) % 2:
        filtered[-1] = cap
    return filtered


def block_costs(left: NDArray[np.uint8], right: NDArray[np.uint8], columns: Columns) -> NDArray[np.int32]:
    """Return the sums of absolute differences over all blocks: int32, disparities x rows x columns."""
    block_size = columns.block_size
    shape      = (columns.disparities, left.shape[0] - block_size + 1, columns.count)
    costs      = np.empty(shape, np.int32)
    left_part  = left[:, columns.left()].astype(np.int16)
    for index in range(columns.disparities):
        right_part   = right[:, columns.right(columns.min_disparity + index)].astype(np.int16)
        costs[index] = block_sums(np.abs(left_part - right_part).astype(np.uint8), block_size)
    return costs


def winners(costs: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return the index of the smallest cost, the largest index of equal ones, and that cost: both rows x columns."""
    index = len(costs) - 1 - np.argmin(costs[::-1], axis=0)
    return index, np.take_along_axis(costs, index[None], axis=0)[0]


def texture_sums(left: NDArray[np.uint8], cap: int, columns: Columns) -> NDArray[np.int32]:
    """Return the sums over all blocks of |prefiltered left image - `cap`|: int32, rows x columns."""
    texture = np.abs(left[:, columns.left()].astype(np.int16) - cap)
    return block_sums(texture.astype(np.uint8), columns.block_size)


def uniqueness_mask(costs: NDArray[np.int32], index: NDArray[np.intp], ratio: int) -> NDArray[np.bool_]:
    """Return where the winner is unique: bool, rows x columns.

    A winner is unique if all costs except its own and those of its two neighbours exceed its own by more than `ratio`
    percent of it, rounded down. With a `ratio` of 0 every winner is unique.
    """
    if ratio <= 0:
        return np.ones(index.shape, bool)
    best  = np.take_along_axis(costs, index[None], axis=0)[0].astype(np.int64)
    other = np.full(index.shape, NO_COST, np.int32)
    for rival, cost in enumerate(costs):
        other = np.where(np.abs(index - rival) > 1, np.minimum(other, cost), other)
    return other > best + best*ratio//100


def subpixel(costs: NDArray[np.int32], index: NDArray[np.intp], min_disparity: int) -> NDArray[np.int16]:
    """Interpolate the winner between the two neighbouring costs: int16, rows x columns, in sixteenths of a pixel.

    A winner at either end of the range keeps its whole number of pixels.
    """
    last = len(costs) - 1

    def cost_at(step: int) -> NDArray[np.int64]:
        place = np.clip(index + step, 0, last)
        return np.take_along_axis(costs, place[None], axis=0)[0].astype(np.int64)

    below, above = cost_at(-1), cost_at(1)
    slope        = np.abs(below - above)
    scale        = below + above - 2*cost_at(0) + slope
    inside       = (index > 0) & (index < last) & (scale > 0)
    offset       = np.where(inside, np.sign(below - above)*(slope*256//np.maximum(scale, 1)), 0)
    return (((min_disparity + index)*256 + offset + 15) >> (8 - DISPARITY_SHIFT)).astype(np.int16)


def left_right_check(disparity: NDArray[np.int16], cost: NDArray[np.int32], max_difference: int,
                     columns: Columns) -> NDArray[np.bool_]:
    """Return where a disparity agrees with the other pixels that match the same column of the right image.

    Every valid disparity votes for the column of the right image that it leads to. The vote with the smallest cost wins
    the column, the one furthest to the left of equal costs. A disparity is rejected if the columns that it leads to,
    rounded down and up, both have a winner that differs by more than `max_difference` pixels.

    OpenCV 5.0.0 itself does this only with `prefilter_cap` <= 31 and `block_size` <= 21, where a cost fits into
    15 bits: above, it writes costs of 32 bits into a matrix of 16 bits and compares the truncated values.

    Parameters
    ----------
    disparity, cost
        Rows x columns; (min_disparity - 1)*16 and less means no disparity.
    max_difference
        In pixels; negative for no check.
    columns
        Description of the columns.

    Returns
    -------
    bool, rows x columns.
    """
    keep = np.ones(disparity.shape, bool)
    if max_difference < 0:
        return keep
    rows     = np.arange(len(disparity))
    invalid  = (columns.min_disparity - 1) << DISPARITY_SHIFT
    # The first of the columns neither votes nor is checked. It never has a whole block.
    checked  = range(max(columns.min_disparity + columns.disparities, 0) - columns.first, columns.count)
    winner   = np.full((len(disparity), columns.width), invalid, np.int32)
    smallest = np.full(winner.shape, NO_COST, np.int32)
    for step in checked:
        found  = disparity[:, step].astype(np.int32)
        column = np.clip(columns.first + step - ((found + 8) >> DISPARITY_SHIFT), 0, columns.width - 1)
        votes  = (found > invalid) & (cost[:, step] < smallest[rows, column])
        smallest[rows[votes], column[votes]] = cost[votes, step]
        winner[rows[votes], column[votes]]   = found[votes]
    for step in checked:
        found   = disparity[:, step].astype(np.int32)
        differs = found > invalid
        for rounded in (found >> DISPARITY_SHIFT, (found + 15) >> DISPARITY_SHIFT):
            column   = columns.first + step - rounded
            inside   = (column >= 0) & (column < columns.width)
            held     = np.where(inside, winner[rows, np.clip(column, 0, columns.width - 1)], invalid)
            differs &= (held > invalid) & (np.abs(held - found) > max_difference << DISPARITY_SHIFT)
        keep[:, step] = ~differs
    return keep


def median3x3(disparity: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return the median of each pixel and its eight neighbours, as `cv2.medianBlur` does: int16, H x W.

    The outermost pixels of the map are repeated outside of it. A pixel without a disparity counts with its value, which
    is less than any disparity.
    """
    return np.asarray(cv2.medianBlur(disparity, 3), np.int16)
