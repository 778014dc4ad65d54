#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference model of rectification in NumPy: the map between the nodes of a grid, cv2.remap in integers, rows to keep.

A map is two arrays u, v (int32, H x W): column and row in the raw image of each rectified pixel, in 32nds of a pixel. A
grid is int16, rows x columns x 2: the displacement of each node in columns and rows, in 128ths of a pixel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Map   = tuple[NDArray[np.int32], NDArray[np.int32]]
Grid  = NDArray[np.int16]

STEP          = 16  #: pixels between two nodes
NODE_ONE      = 128 #: displacement of a node by one pixel
ONE           = 32  #: position of a pixel by one pixel
FRACTION_BITS = 5

# Map ----------------------------------------------------------------------------------------------


def grid_shape(width: int, height: int) -> tuple[int, int]:
    """Return rows and columns of the nodes for images of a size: the last ones are at or beyond the last pixel."""
    return (height - 1)//STEP + 2, (width - 1)//STEP + 2


def _values(grid: Grid, height: int, columns: slice) -> NDArray[np.int64]:
    """Return the displacement down the columns of nodes, in 2048ths of a pixel: height x columns x 2."""
    nodes = grid.astype(np.int64)[:, columns]
    row   = np.arange(height)
    upper, lower, line = nodes[row//STEP], nodes[row//STEP + 1], (row % STEP)[:, None, None]
    return STEP*upper + line*(lower - upper)


def expand(grid: Grid, width: int, height: int) -> Map:
    """Return the map of a grid: linear between the nodes, exact, and then rounded once, half up."""
    column = np.arange(width)
    edges  = _values(grid, height, slice(None))
    left, right, place = edges[:, column//STEP], edges[:, column//STEP + 1], (column % STEP)[None, :, None]
    value  = STEP*left + place*(right - left)
    # 15 bits of fraction become five.
    result = (value + 512) >> 10
    u = result[..., 0] + ONE*column[None, :]
    v = result[..., 1] + ONE*np.arange(height)[:, None]
    return u.astype(np.int32), v.astype(np.int32)


def folded(grid: Grid, width: int, height: int) -> NDArray[np.bool_]:
    """Return the pixels (bool, H x W) between two columns of nodes where the map folds over.

    There the positions along the row do not go to the right, or a node below one of the two nodes is not below.
    """
    edges   = _values(grid, height, slice(None))
    across  = edges[:, 1:, 0] - edges[:, :-1, 0] <= -NODE_ONE*STEP*STEP
    rows    = grid[..., 1].astype(np.int64)
    down    = (rows[1:] - rows[:-1] <= -NODE_ONE*STEP)[np.arange(height)//STEP]
    pieces  = across | down[:, 1:] | down[:, :-1]
    return pieces[:, np.arange(width)//STEP]


# Pixels -------------------------------------------------------------------------------------------


def blend(p00, p01, p10, p11, column_fraction, row_fraction) -> NDArray[np.uint8]:
    """Return the pixels between 2 x 2 pixels, at fractions in 32nds: weighted sum, rounded half up."""
    pixels = [np.asarray(values, np.int64) for values in (p00, p01, p10, p11)]
    a, b   = np.asarray(column_fraction, np.int64), np.asarray(row_fraction, np.int64)
    weights = [(ONE - b)*(ONE - a), (ONE - b)*a, b*(ONE - a), b*a]
    total  = sum(weight*values for weight, values in zip(weights, pixels, strict=True))
    return ((total + ONE*ONE//2) >> 2*FRACTION_BITS).astype(np.uint8)


def neighbours(image: Image, positions: Map) -> list[NDArray[np.uint8]]:
    """Return the pixels p00, p01, p10, p11 around each position; those outside of the image are 0."""
    height, width = image.shape
    column, row   = positions[0] >> FRACTION_BITS, positions[1] >> FRACTION_BITS
    result        = []
    for y in (row, row + 1):
        for x in (column, column + 1):
            inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
            pixel  = image[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
            result.append(np.where(inside, pixel, 0).astype(np.uint8))
    return result


def remap(image: Image, positions: Map) -> Image:
    """Return the rectified image: `cv2.remap` with fixed-point maps, INTER_LINEAR, border 0."""
    return blend(*neighbours(image, positions), positions[0] & ONE - 1, positions[1] & ONE - 1)


# Rows ---------------------------------------------------------------------------------------------


def rows_of(positions: Map) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return for each position, in raster order, the count of rows that must be complete, and the first row it needs.

    A position without a neighbour inside of the image needs no row: the count is 0, the first row that of the image's
    end.
    """
    height, width = positions[0].shape
    column, row   = (np.asarray(values, np.int64).ravel() >> FRACTION_BITS for values in positions)
    used   = (column >= -1) & (column < width) & (row >= -1) & (row < height)
    needed = np.where(used, np.minimum(row + 2, height), 0)
    oldest = np.where(used, np.maximum(row, 0), height)
    return needed, oldest


def rows_needed(maps: Sequence[Map], lead: int) -> int:
    """Return the rows, an even number, that the rings of all cameras must have for these maps.

    Rows come in up to `lead` ahead of the newest one that any position so far has needed; one more is under way.
    """
    rows  = [rows_of(positions) for positions in maps]
    newest = np.maximum.accumulate(np.max([needed for needed, _ in rows], axis=0))
    span   = max(int((newest - oldest).max()) for _, oldest in rows)
    return max(span + lead + 1 + 1 & ~1, 4)


def delay_rows(maps: Sequence[Map]) -> int:
    """Return by how many rows the last rectified pixel leaves later than it could at a pixel per clock."""
    height, width = maps[0][0].shape
    newest = np.maximum.accumulate(np.max([rows_of(positions)[0] for positions in maps], axis=0))
    return math.ceil(float((newest - np.arange(height*width)/width).max()))


def steady_lead(maps: Sequence[Map]) -> int:
    """Return the `lead` with which frames that follow one another take a clock per pixel.

    Rows then come in evenly: at any time as many ahead of the rectified row as the first rows of a frame need.
    """
    height, width = maps[0][0].shape
    newest = np.maximum.accumulate(np.max([rows_of(positions)[0] for positions in maps], axis=0))
    behind = float((newest - np.arange(height*width)/width).min())
    return max(delay_rows(maps) - math.floor(behind), 0)
