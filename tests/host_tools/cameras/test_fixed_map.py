#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host rectifies in integers, as the model and every OpenCV do, and in one place only."""

from __future__ import annotations

import ast

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.cameras.fixed_map import FixedMap
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.grid import grid_shape
from litestereo.sim.models import rectification as model
from support.pairs import generator
from support.paths import CHECKOUT
from support.rectification_maps import drawn_pair
from support.rigs import KINDS, LENSES, drawn_maps, lens_cameras

WIDTH, HEIGHT = 320, 240

#: OpenCV's functions of rectification, and the one file that calls each.
CALLED_IN = {
    "remap":                   "host_tools/cameras/fixed_map.py",
    "convertMaps":             "host_tools/cameras/fixed_map.py",
    "initUndistortRectifyMap": "host_tools/cameras/float_maps.py",
}

#: Others that interpolate float maps inside.
FORBIDDEN = {"undistort", "undistortImage", "initInverseRectificationMap", "warpPolar", "warpAffine", "warpPerspective"}


def test_one_place_calls_opencv():
    """With float maps the versions of OpenCV differ: every other call is an error."""
    found = {}
    for room in ("gateware", "host_tools", "sim", "soc"):
        for path in sorted((CHECKOUT/room).rglob("*.py")):
            names = {node.attr for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                     if isinstance(node, ast.Attribute) and ast.unparse(node.value).startswith("cv2")}
            assert not names & FORBIDDEN, path
            for name in names & set(CALLED_IN):
                found.setdefault(name, []).append(path.relative_to(CHECKOUT).as_posix())
    assert found == {name: [path] for name, path in CALLED_IN.items()}


@pytest.mark.parametrize("view", LENSES)
def test_drawn_rigs_are_rectified_as_by_the_model(view):
    """Of a grid, or of a position for each pixel: the bits are those of the model's integers."""
    rng  = generator(345, view)
    done = 0
    while done < 3:
        cameras   = lens_cameras(rng, view, 2, WIDTH, HEIGHT)
        rectifier = Rectifier(*cameras)
        grids     = rectifier.pair.grids
        if grids is None:
            continue
        images = drawn_pair(WIDTH, HEIGHT, rng)
        for image, moved, grid in zip(images, rectifier.rectify(*images), grids.grids, strict=True):
            assert np.array_equal(moved, model.remap(image, model.expand(grid.nodes, WIDTH, HEIGHT)))
        assert grids.error.rms_px < 0.05
        assert grids.rows == model.rows_needed([model.expand(grid.nodes, WIDTH, HEIGHT) for grid in grids.grids], 2)
        done += 1


@pytest.mark.parametrize("kind", KINDS)
def test_positions_of_each_pixel(kind):
    """Positions are rounded to 32nds, half to even, also far outside of the image."""
    rng   = generator(346)
    image = drawn_pair(WIDTH, HEIGHT, rng)[0]
    for columns, rows in drawn_maps(rng, kind, 2, WIDTH, HEIGHT):
        far                = rng.random(columns.shape) < 0.01
        columns, rows      = (np.where(far, np.float32(-1e4), values) for values in (columns, rows))
        columns[0], columns[1] = rng.uniform(-1, 1, WIDTH), rng.uniform(WIDTH - 2, WIDTH + 1, WIDTH)
        positions          = tuple(np.rint(32*values.astype(np.float64)).astype(np.int32) for values in (columns, rows))
        mapped             = FixedMap.of_pixels((columns, rows))
        assert np.array_equal(mapped.remap(image), model.remap(image, positions))
        inside = [(values >= -4) & (values <= 32*(size - 1) + 4)
                  for values, size in zip(positions, (WIDTH, HEIGHT), strict=True)]
        assert np.array_equal(mapped.covered, inside[0] & inside[1])


def test_images_of_other_types():
    """Each channel is rectified alone, and 16 bits stay."""
    rng       = generator(347)
    rectifier = Rectifier(*lens_cameras(rng, 60, 1, WIDTH, HEIGHT))
    colours   = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    moved     = rectifier.rectify(colours, colours)[0]
    for channel in range(3):
        grey = np.ascontiguousarray(colours[..., channel])
        assert np.array_equal(moved[..., channel], rectifier.rectify(grey, grey)[0])
    deep = rng.integers(0, 65536, (HEIGHT, WIDTH)).astype(np.uint16)
    assert rectifier.rectify(deep, deep)[1].dtype == np.uint16


def test_rectified_cameras_leave_images_as_they_are():
    geometry  = StereoGeometry(WIDTH, HEIGHT, 300.0, 0.1, 150.25, 120.5, 149.75)
    rectifier = Rectifier(*ideal_cameras(geometry))
    grids     = rectifier.pair.grids.grids
    assert all(not grid.nodes.any() and grid.nodes.shape == (*grid_shape(WIDTH, HEIGHT), 2) for grid in grids)
    pair = drawn_pair(WIDTH, HEIGHT, generator(348))
    for image, moved in zip(pair, rectifier.rectify(*pair), strict=True):
        assert np.array_equal(image, moved)
