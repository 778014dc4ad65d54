#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Grids and maps of all kinds, and OpenCV as their reference. It needs no migen."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from litestereo.sim.models import rectification as model

Image = NDArray[np.uint8]
Grid  = NDArray[np.int16]
Pair  = tuple[Image, Image]


def opencv_remap(image: Image, positions: model.Map) -> Image:
    """Return `cv2.remap` of a map in 32nds of a pixel, as OpenCV stores it."""
    u, v  = positions
    whole = np.dstack([u >> 5, v >> 5]).astype(np.int16)
    return np.asarray(cv2.remap(image, whole, ((v & 31)*32 + (u & 31)).astype(np.uint16), cv2.INTER_LINEAR), np.uint8)


# Grids --------------------------------------------------------------------------------------------


def places(width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return column and row of the nodes, from the centre of the image."""
    rows, columns = model.grid_shape(width, height)
    row, column   = np.mgrid[:rows, :columns]*model.STEP
    return column - (width - 1)/2, row - (height - 1)/2


def as_grid(columns: NDArray, rows: NDArray) -> Grid:
    """Return the grid of displacements in pixels."""
    nodes = np.rint(np.stack(np.broadcast_arrays(columns, rows), axis=-1)*model.NODE_ONE)
    return np.clip(nodes, -2**15, 2**15 - 1).astype(np.int16)


def shifted(width: int, height: int, columns: float, rows: float) -> Grid:
    """Return a grid that shifts an image."""
    x, _ = places(width, height)
    return as_grid(np.full_like(x, columns), np.full_like(x, rows))


def lens(width: int, height: int, rng: np.random.Generator, degrees: float = 3.0, barrel: float = 0.06) -> Grid:
    """Return the grid of a distorting, turned, shifted camera: like those of small rigs."""
    x, y   = places(width, height)
    radius = (x*x + y*y)/(width*width/4)
    angle  = np.deg2rad(rng.uniform(-degrees, degrees))
    scale  = rng.uniform(0.9, 1.02) - rng.uniform(0, barrel)*radius
    moved  = rng.uniform(-2, 2, 2)
    return as_grid((scale*np.cos(angle) - 1)*x - np.sin(angle)*y + moved[0],
                   np.sin(angle)*x + (scale*np.cos(angle) - 1)*y + moved[1])


def noise(width: int, height: int, rng: np.random.Generator, columns: float = 3, rows: float = 3) -> Grid:
    """Return a grid of drawn nodes, up to so many pixels off."""
    x, _ = places(width, height)
    return as_grid(rng.uniform(-columns, columns, x.shape), rng.uniform(-rows, rows, x.shape))


def drawn_grids(width: int, height: int, rng: np.random.Generator) -> tuple[Grid, Grid]:
    """Return the grids of both cameras, of any kind."""
    kind = rng.integers(4)
    if kind == 0:
        return lens(width, height, rng), lens(width, height, rng)
    if kind == 1:
        return noise(width, height, rng), noise(width, height, rng)
    if kind == 2:
        return noise(width, height, rng, 200, 5), lens(width, height, rng)
    x, y = rng.uniform(-6, 6, 2)
    return shifted(width, height, x, y), shifted(width, height, y, x)


def maps_of(grids: Sequence[Grid], width: int, height: int) -> list[model.Map]:
    """Return the map of each grid."""
    return [model.expand(grid, width, height) for grid in grids]


# Pairs ------------------------------------------------------------------------------------------------


def check_pair(got: Pair, raw: Pair, maps: Sequence[model.Map]) -> None:
    """Assert that a rectified pair is that of the model and of OpenCV, on every pixel."""
    for side, image, raw_image, positions in zip(("left", "right"), got, raw, maps, strict=True):
        expected = model.remap(raw_image, positions)
        assert np.array_equal(expected, opencv_remap(raw_image, positions))
        wrong = np.argwhere(image != expected)
        assert len(wrong) == 0, f"{side}: {len(wrong)} pixels differ, the first at {wrong[0].tolist()}"


def drawn_pair(width: int, height: int, rng: np.random.Generator) -> Pair:
    """Return two images of noise with extreme values."""
    left, right = (rng.choice([0, 255, *range(256)], (height, width)).astype(np.uint8) for _ in range(2))
    return left, right
