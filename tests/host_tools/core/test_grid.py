#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map of a calibration as a device holds it: its error, its rows, and what is refused."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import GeometryError
from litestereo.host_tools.core.grid import Grid, RowBudget, fit_grid, grid_error, grid_shape, row_budget
from litestereo.sim.models import rectification as model
from support.pairs import generator
from support.rectification_maps import noise
from support.rigs import KINDS, drawn_maps

#: Largest error and root of the mean square at 640 x 480, in pixels. Rounding to 32nds alone gives 0.022 and 0.013.
LARGEST, MEAN = 0.12, 0.027


def identity(width, height):
    """Return the maps that leave an image as it is."""
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return columns, rows


@pytest.mark.parametrize("kind", KINDS)
def test_fit(kind):
    """Lenses of 44 to 90 degrees and fisheyes, misaligned by 3 degrees: the error is small, and 80 rows suffice."""
    rng   = generator(340)
    maps  = drawn_maps(rng, kind, 3, 640, 480)
    grids = [fit_grid(one) for one in maps]
    for grid, one in zip(grids, maps, strict=True):
        error = grid_error(grid, one)
        assert error.max_px < LARGEST and error.rms_px < MEAN
    budget = row_budget(grids)
    assert budget.rows(2) <= 80
    print(kind, budget)


def test_least_squares():
    """No change of a node makes the map nearer, apart from rounding; a map that is linear between nodes is met."""
    rng   = generator(341)
    nodes = rng.integers(-300, 300, (*grid_shape(40, 30), 2)).astype(np.int16)
    exact = Grid(40, 30, nodes)
    # Without the rounding to 32nds.
    row, column = np.arange(30), np.arange(40)
    tent  = [np.maximum(0, 1 - abs(places[:, None] - 16*np.arange(size))/16)
             for places, size in zip((row, column), nodes.shape[:2], strict=True)]
    moved = [tent[0] @ nodes[..., axis] @ tent[1].T/128 for axis in (0, 1)]
    maps  = (moved[0] + column, moved[1] + row[:, None])
    # Nodes outside of the image, which few pixels depend on, are met too.
    assert np.array_equal(fit_grid(maps).nodes, nodes)
    assert grid_error(exact, maps).max_px <= np.hypot(1, 1)/64 + 1e-9


@pytest.mark.parametrize("width, height", [(640, 480), (33, 17), (32, 16), (752, 479)])
def test_the_map_is_the_model_s(width, height):
    """Grid, rows and OpenCV's maps are those of the reference model."""
    rng   = generator(342, width)
    nodes = [noise(width, height, rng, 7, 7) for _ in range(2)]
    grids = [Grid(width, height, one) for one in nodes]
    maps  = [model.expand(one, width, height) for one in nodes]
    for grid, (u, v) in zip(grids, maps, strict=True):
        assert np.array_equal(grid.expand()[0], u) and np.array_equal(grid.expand()[1], v)
        image = rng.integers(0, 256, (height, width), np.uint8)
        assert np.array_equal(cv2.remap(image, *grid.opencv_maps(), cv2.INTER_LINEAR), model.remap(image, (u, v)))
    budget = row_budget(grids)
    assert [budget.rows(lead) for lead in range(5)] == [model.rows_needed(maps, lead) for lead in range(5)]
    assert max(budget.delay, 0) == max(model.delay_rows(maps), 0) and budget.steady_lead == model.steady_lead(maps)


def test_identity():
    """All nodes are 0: raw frames pass unchanged."""
    grid = fit_grid(identity(100, 60))
    assert not grid.nodes.any()
    assert row_budget([grid, grid]) == RowBudget(span=2, delay=2, steady_lead=2)


def test_what_is_refused():
    """Maps that a device cannot hold, maps that fold over, and too many rows are refused with numbers."""
    columns, rows = identity(100, 60)
    with pytest.raises(GeometryError, match="moves pixels by up to 300 pixels, a device by less than 256"):
        fit_grid((columns + 300, rows))
    with pytest.raises(GeometryError, match="moves pixels by up to inf"):
        fit_grid((columns, np.where(rows == 3, np.nan, rows)))
    for folded in ((99 - columns, rows), (columns, 59 - rows)):
        with pytest.raises(GeometryError, match="folds over"):
            fit_grid(folded)
    with pytest.raises(GeometryError, match="100x60 pixels has 8 x 5 nodes of int16"):
        Grid(100, 60, np.zeros((5, 9, 2), np.int16))
    apart = [fit_grid((columns, rows + below)) for below in (0, 20)]
    row_budget(apart).check(26, 2)
    with pytest.raises(GeometryError, match="needs 26 rows of the images at once, the device holds 24"):
        row_budget(apart).check(24, 2)
