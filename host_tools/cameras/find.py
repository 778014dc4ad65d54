#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Finds a board in pairs of images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .board import Board

#: Least number of corners that both cameras must see.
_MIN_COMMON_CORNERS = 6

Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class BoardPair:
    """Corners of the board that both images of a pair show.

    `points_m` are their positions on the board: float32, N x 3, in metres. `left_px` and `right_px` are those in the
    images: float32, N x 2, in pixels.
    """

    name:     str
    points_m: NDArray[np.float32]
    left_px:  NDArray[np.float32]
    right_px: NDArray[np.float32]


@dataclass(frozen=True)
class BadPair:
    """A pair that was not used, and why."""

    name:   str
    reason: str


def find_board(name: str, left: Image, right: Image, board: Board) -> BoardPair | BadPair:
    """Find a board in a pair of images (uint8, H x W)."""
    if left.shape != right.shape:
        return BadPair(name, f"left is {left.shape[1]}x{left.shape[0]} pixels, right {right.shape[1]}x{right.shape[0]}")
    found   = [board.find(left), board.find(right)]
    missing = [side for side, corners in zip(("left", "right"), found, strict=True) if corners is None]
    if found[0] is None or found[1] is None:
        return BadPair(name, f"pattern not found in the {' and the '.join(missing)} image")
    common, in_left, in_right = np.intersect1d(found[0].ids, found[1].ids, return_indices=True)
    if len(common) < _MIN_COMMON_CORNERS:
        return BadPair(name, f"only {len(common)} corners in both images, {_MIN_COMMON_CORNERS} are needed")
    left_px, right_px = found[0].pixels[in_left], found[1].pixels[in_right]
    # A chessboard may be found upside down in one of the images; the cameras of a pair are the same way up.
    if np.dot(left_px[-1] - left_px[0], right_px[-1] - right_px[0]) < 0:
        right_px = right_px[::-1]
    return BoardPair(name, board.points_m[common], left_px, np.ascontiguousarray(right_px))
