#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The model of rectification against its definition written out, and against cv2.remap."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from litestereo.sim.models import rectification as model
from support.pairs import generator
from support.rectification_maps import as_grid, drawn_grids, drawn_pair, lens, noise, opencv_remap, shifted


@pytest.mark.parametrize("width, height", [(33, 17), (32, 16), (20, 50)])
def test_map(width, height):
    """The map of drawn and of extreme nodes is the definition, in exact fractions."""
    rng = generator(330, width)
    for grid in (noise(width, height, rng, 200, 200),
                 rng.choice([-2**15, 2**15 - 1], (*model.grid_shape(width, height), 2)).astype(np.int16)):
        u, v = model.expand(grid, width, height)
        for row in range(height):
            for column in range(width):
                i, line  = divmod(row, 16)
                j, place = divmod(column, 16)
                for axis, (got, own) in enumerate(((u, column), (v, row))):
                    n     = [[int(grid[i + di, j + dj, axis]) for dj in (0, 1)] for di in (0, 1)]
                    # In 32768ths of a pixel.
                    exact = ((16 - line)*((16 - place)*n[0][0] + place*n[0][1])
                             + line*((16 - place)*n[1][0] + place*n[1][1]))
                    assert got[row, column] == (2*exact + 1024)//2048 + 32*own


def test_remap():
    """Drawn maps, positions far outside, and all fractions give OpenCV's pixels."""
    rng = generator(331)
    for number in range(20):
        width, height = (int(size) for size in rng.integers(18, 80, 2))
        raw, grids = drawn_pair(width, height, rng), drawn_grids(width, height, rng)
        for image, grid in zip(raw, grids, strict=True):
            positions = model.expand(grid, width, height)
            if number % 4 == 3:
                positions = tuple(values + rng.integers(-3000, 3000, values.shape).astype(np.int32)
                                  for values in positions)
            assert np.array_equal(model.remap(image, positions), opencv_remap(image, positions))


def test_opencv_converts_maps_like_that():
    """`cv2.convertMaps` of a map in 32nds gives the numbers that the tests hand to cv2.remap."""
    u, v   = model.expand(lens(60, 40, generator(332)), 60, 40)
    whole, fractions = cv2.convertMaps((u/32).astype(np.float32), (v/32).astype(np.float32), cv2.CV_16SC2)
    assert np.array_equal(whole, np.dstack([u >> 5, v >> 5]))
    assert np.array_equal(fractions, (v & 31)*32 + (u & 31))


def test_rows():
    """Rows of shifts and of a distance between the cameras, by hand; positions outside of the image need none."""
    def maps(*rows):
        return [model.expand(shifted(40, 30, 0, below), 40, 30) for below in rows]

    # A row and the one below it; with the next one that comes in: 3, and an even number.
    assert [model.rows_needed(maps(0), lead) for lead in (0, 1, 2)] == [4, 4, 6]
    assert model.rows_needed(maps(0, 10), 1) == 14 and model.rows_needed(maps(0, -10), 1) == 14
    assert model.rows_needed(maps(100, -100), 0) == 4
    assert [model.delay_rows(maps(below)) for below in (0, 7, -7)] == [2, 9, 0]
    # The rows above the first and below the last position come in between two frames.
    assert [model.steady_lead(maps(below)) for below in (0, 7)] == [2, 9]


def test_folds():
    """A piece that runs back, or stays, is folded, and only that one."""
    x, y = np.meshgrid(np.arange(4), np.arange(3))
    grid = as_grid(np.where(x == 2, -16.0, 0), y*0)
    fold = model.folded(grid, 48, 20)
    assert fold[:, 16:32].all() and not fold[:, :16].any() and not fold[:, 32:].any()
    down = as_grid(x*0, np.where((y == 1) & (x == 3), -16.0, 0))
    fold = model.folded(down, 48, 20)
    assert fold[:16, 32:].all() and not fold[:, :32].any() and not fold[16:].any()
