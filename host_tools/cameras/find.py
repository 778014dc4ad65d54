#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Finds a board in pairs of images."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .board import Board

#: Least number of corners that both cameras must see.
_MIN_COMMON_CORNERS = 6

#: Least eighth singular value, relative to the first, of the equations of a homography: positions on a board are exact,
#: those in an image have noise.
_LEAST_RANK       = 1e-6
_LEAST_IMAGE_RANK = 1e-3

Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class BoardPair:
    """Corners of the board that both images of a pair show.

    `points_m` are their positions on the board: float32, N x 3, in metres. `left_px` and `right_px` are those in the
    images: float32, N x 2, in pixels. `rotated_px` are the right ones in the order of each other rotation in which the
    board looks the same: the cameras are the same way up, or one is rotated to the other.
    """

    name:       str
    points_m:   NDArray[np.float32]
    left_px:    NDArray[np.float32]
    right_px:   NDArray[np.float32]
    rotated_px: tuple[NDArray[np.float32], ...] = ()

    def rotated(self, index: int) -> BoardPair:
        """Return the pair with the right corners in the order of `rotated_px[index]`."""
        return replace(self, right_px=self.rotated_px[index], rotated_px=())


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
    points, left_px, right_px = board.points_m[common], found[0].pixels[in_left], found[1].pixels[in_right]
    if not spans_plane(points[:, :2], _LEAST_RANK):
        return BadPair(name, f"its {len(common)} corners are on one line of the board")
    for side, pixels in (("left", left_px), ("right", right_px)):
        if not spans_plane(pixels, _LEAST_IMAGE_RANK):
            return BadPair(name, f"its {len(common)} corners are on one line of the {side} image")
    orders = [right_px[order] for order in board.rotations if len(order) == len(common)]
    if orders:
        # The board looks the same in several rotations; the cameras of a pair are the same way up.
        first    = int(np.argmin([_distance(left_px, order) for order in orders]))
        orders   = orders[first:] + orders[:first]
        right_px = orders[0]
    return BoardPair(name, points, left_px, np.ascontiguousarray(right_px), tuple(orders[1:]))


def _distance(left_px: NDArray[np.float32], right_px: NDArray[np.float32]) -> float:
    """Return how far corners are apart if their centres are at one place: sum of squares, in pixels."""
    return float(np.square(left_px - left_px.mean(axis=0) - right_px + right_px.mean(axis=0)).sum())


def spans_plane(points: NDArray[np.float32], least: float) -> bool:
    """Return whether points (float32, N x 2) determine a homography: four of them, no three of these on a line.

    `least` is the smallest valid ratio of the eighth to the first singular value of the homography's equations.
    """
    centred = points.astype(np.float64) - points.mean(axis=0)
    scale   = float(np.abs(centred).max())
    if len(points) < 4 or scale == 0:
        return False
    x, y = centred.T/scale
    none, one = np.zeros(len(x)), np.ones(len(x))
    equations = np.concatenate([np.stack([x, y, one, none, none, none, -x*x, -x*y, -x], axis=1),
                                np.stack([none, none, none, x, y, one, -y*x, -y*y, -y], axis=1)])
    values    = np.linalg.svd(equations, compute_uv=False)
    return bool(values[7] > least*values[0])
