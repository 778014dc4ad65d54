#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Maps of rectification as a device holds them: displacements at nodes, linear between them.

A device interpolates the map of each camera between nodes that are 16 pixels apart, in integers; docs/rectification.md
has the arithmetic. `fit_grid` finds the nodes with which that is nearest to a map, `Grid.expand` is the map that the
device then has, and `Grid.opencv_maps` the same for `cv2.remap`.
"""

from __future__ import annotations

import functools
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import GeometryError

#: Pixels between two nodes.
STEP = 16

#: Displacement of a node by one pixel.
NODE_ONE = 128

#: Position of a pixel of the map, in whole numbers.
ONE = 32

#: Rows that come in before they are needed, as devices have it: a frame then takes about a clock per pixel.
LEAD = 2

#: Columns and rows, float32 or float64, H x W, in pixels.
FloatMaps = tuple[NDArray[np.floating], NDArray[np.floating]]

#: Columns and rows, int32, H x W, in 32nds of a pixel.
FixedMaps = tuple[NDArray[np.int32], NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class Grid:
    """The map of a camera for a device.

    Parameters
    ----------
    width, height
        Size of the images in pixels.
    nodes
        Displacement of each node in columns and rows: int16, rows x columns x 2, in 128ths of a pixel.

    Raises
    ------
    GeometryError
        The number of nodes is not that of the size, or the map folds over.
    """

    width:  int
    height: int
    nodes:  NDArray[np.int16]

    def __post_init__(self) -> None:
        shape = (*grid_shape(self.width, self.height), 2)
        if self.nodes.shape != shape or self.nodes.dtype != np.int16:
            raise GeometryError(f"a grid for {self.width}x{self.height} pixels has {shape[1]} x {shape[0]} nodes of "
                                f"int16, not {self.nodes.shape} of {self.nodes.dtype}")
        moved = self.nodes.astype(np.int64)
        least = min(np.diff(moved[..., 0], axis=1).min(), np.diff(moved[..., 1], axis=0).min())
        if least <= -STEP*NODE_ONE:
            raise GeometryError("the map of the rectification folds over: two places of the rectified image show the "
                                "same part of a camera's; a smaller alpha leaves out the edge where that happens")

    def expand(self) -> FixedMaps:
        """Return the map that a device makes of the grid: int32, H x W each, in 32nds of a pixel."""
        row, column = np.arange(self.height, dtype=np.int32), np.arange(self.width, dtype=np.int32)
        line, place = (row % STEP)[:, None], (column % STEP)[None, :]

        def moved(nodes: NDArray[np.int16]) -> NDArray[np.int32]:
            wide         = nodes.astype(np.int32)
            upper, lower = wide[row//STEP], wide[row//STEP + 1]
            edges        = STEP*upper + line*(lower - upper)
            left, right  = edges[:, column//STEP], edges[:, column//STEP + 1]
            # Exact, 15 bits of fraction in at most 26 bits; rounded half up to five.
            return np.asarray((STEP*left + place*(right - left) + 512) >> 10, np.int32)

        return moved(self.nodes[..., 0]) + ONE*column[None, :], moved(self.nodes[..., 1]) + ONE*row[:, None]

    def opencv_maps(self) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
        """Return the map for `cv2.remap`: int16, H x W x 2, and uint16, H x W, as `cv2.convertMaps` makes them."""
        columns, rows = self.expand()
        whole = np.stack([columns >> 5, rows >> 5], axis=-1).astype(np.int16)
        return whole, ((rows & 31)*ONE + (columns & 31)).astype(np.uint16)


#: The maps of the left and the right camera.
GridPair = tuple[Grid, Grid]


@dataclass(frozen=True)
class GridError:
    """Distance between the map of a grid and a map, in pixels."""
    max_px: float
    rms_px: float


@dataclass(frozen=True)
class RowBudget:
    """What a pair of maps needs of a device's rings of rows.

    Parameters
    ----------
    span
        Rows that both rings must hold at once, without `lead`.
    delay
        Rows that come in before a rectified row leaves, at most.
    steady_lead
        `lead` with which frames that follow one another take a clock per pixel.
    """

    span:        int
    delay:       int
    steady_lead: int

    def rows(self, lead: int) -> int:
        """Return the rows that a ring must have if rows come in up to `lead` before they are needed; even."""
        return max(self.span + lead + 2 & ~1, 4)

    def check(self, rows: int, lead: int) -> None:
        """Raise GeometryError if a device whose rings have `rows` rows cannot use the maps."""
        if self.rows(lead) > rows:
            raise GeometryError(f"the rectification needs {self.rows(lead)} rows of the images at once, the device "
                                f"holds {rows}: mount the cameras straighter, or use smaller images")


def grid_crc(grids: Sequence[Grid]) -> int:
    """Return the CRC-32 of the nodes of all cameras, by which a pair of grids is named."""
    return zlib.crc32(b"".join(grid.nodes.astype("<i2").tobytes() for grid in grids))


def grid_shape(width: int, height: int) -> tuple[int, int]:
    """Return rows and columns of the nodes for images of a size."""
    return (height - 1)//STEP + 2, (width - 1)//STEP + 2


@functools.lru_cache(maxsize=16)
def _inverse(pixels: int) -> NDArray[np.float64]:
    """Return the matrix that makes nodes of the values along a line of pixels, by least squares: nodes x pixels."""
    nodes = (pixels - 1)//STEP + 2
    hats  = np.zeros((pixels, nodes))
    place = np.arange(pixels)
    hats[place, place//STEP]    += 1 - place % STEP/STEP
    hats[place, place//STEP + 1] += place % STEP/STEP
    return np.asarray(np.linalg.pinv(hats), np.float64)


def fit_grid(maps: FloatMaps) -> Grid:
    """Return the grid whose map is nearest to a map, by least squares.

    Parameters
    ----------
    maps
        Column and row in the camera's image of each rectified pixel: float, H x W, in pixels, as
        `cv2.initUndistortRectifyMap` and `cv2.fisheye.initUndistortRectifyMap` make them.

    Raises
    ------
    GeometryError
        A position is 256 pixels or more off its place, or is no number, or the map folds over.
    """
    height, width = maps[0].shape
    own   = (np.arange(width)[None, :], np.arange(height)[:, None])
    nodes = []
    for values, place in zip(maps, own, strict=True):
        displacement = values.astype(np.float64) - place
        fitted = _inverse(height) @ displacement @ _inverse(width).T if np.isfinite(displacement).all() else np.inf
        # Halves are rounded alike on every computer: the last bits of a sum depend on its order.
        nodes.append(np.rint(np.round(np.asarray(fitted)*NODE_ONE, 6)))
    largest = max(float(np.abs(values).max()) for values in nodes)
    if not largest < 2**15:
        raise GeometryError(f"the rectification moves pixels by up to {largest/NODE_ONE:.0f} pixels, a device by less "
                            f"than {2**15//NODE_ONE}: use smaller images, or cameras that are mounted straighter")
    return Grid(width, height, np.stack(nodes, axis=-1).astype(np.int16))


def grid_error(grid: Grid, maps: FloatMaps) -> GridError:
    """Return the distance between the positions of a grid's map and of a map (float, H x W, in pixels)."""
    columns, rows = (values/ONE for values in grid.expand())
    distance = np.hypot(columns - maps[0], rows - maps[1])
    return GridError(float(distance.max()), float(np.sqrt(np.mean(np.square(distance)))))


def row_budget(grids: Sequence[Grid]) -> RowBudget:
    """Return what the maps of all cameras, which leave in step, need of a device's rings of rows."""
    height, width = grids[0].height, grids[0].width
    needs, firsts = [], []
    for grid in grids:
        column, row = (values.ravel().astype(np.int64) >> 5 for values in grid.expand())
        used = (column >= -1) & (column < width) & (row >= -1) & (row < height)
        needs.append(np.where(used, np.minimum(row + 2, height), 0))
        firsts.append(np.where(used, np.maximum(row, 0), height))
    newest = np.maximum.accumulate(np.max(needs, axis=0))
    ahead  = newest - np.arange(height*width)/width
    delay  = int(np.ceil(ahead.max()))
    return RowBudget(span=int((newest - np.min(firsts, axis=0)).max()), delay=delay,
                     steady_lead=max(delay - int(np.floor(ahead.min())), 0))
