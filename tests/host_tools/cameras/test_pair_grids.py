#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Grids of a pair: which cameras have none, and why; and the boards with room for them."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from litestereo.host_tools.cameras.builds import BUILDS, LEAST_ROWS, MOST_ROWS, boards_with_room
from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.cameras.pair_grids import LEAD, fit_pair
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.grid import Grid, grid_crc, grid_shape
from support.pairs import generator
from support.paths import CHECKOUT
from support.rectification_maps import drawn_pair
from support.rigs import drawn_maps

WIDTH, HEIGHT = 160, 120


def cameras(**changes):
    """Return a pair that is rectified already, but for changes of the left camera."""
    left, right = ideal_cameras(StereoGeometry(WIDTH, HEIGHT, 140.0, 0.06, 79.5, 59.5, 79.5))
    return dataclasses.replace(left, **changes), right


@pytest.mark.parametrize(("changes", "reason"), [
    # The polynomial turns back before the corners.
    ({"distortion": np.array([-1.0, 0, 0, 0])}, "outside of what the left lens can show"),
    ({"distortion": np.array([3.0, 0, 0, 0])}, "bends by"),
])
def test_cameras_without_a_grid(changes, reason):
    """The host rectifies with a position for each pixel."""
    rectifier = Rectifier(*cameras(**changes))
    pair      = rectifier.pair
    assert pair.grids is None and reason in pair.no_grids
    left, right = drawn_pair(WIDTH, HEIGHT, generator(350))
    moved       = rectifier.rectify(left, right)
    assert moved[0].shape == left.shape and np.array_equal(moved[1], right)


def test_a_camera_that_is_mounted_aside():
    left, right = ideal_cameras(StereoGeometry(1000, 64, 900.0, 0.06, 499.5, 31.5, 499.5))
    matrix      = left.camera_matrix.copy()
    matrix[0, 2] += 300
    rectifier   = Rectifier(dataclasses.replace(left, camera_matrix=matrix), right)
    assert "moves pixels by up to 300 pixels, a device by less than 256" in rectifier.pair.no_grids
    image = drawn_pair(1000, 64, generator(353))[0]
    moved = rectifier.rectify(image, image)[0]
    assert np.array_equal(moved[:, :700], image[:, 300:]) and not moved[:, 700:].any()


def test_images_larger_than_any_device_takes():
    rectifier = Rectifier(*ideal_cameras(StereoGeometry(4096, 32, 3000.0, 0.06, 2047.5, 15.5, 2047.5)))
    assert "images of 4096x32 pixels are larger than those of any device, 4095" in rectifier.pair.no_grids


def test_error_and_rows_are_of_both_cameras():
    maps  = drawn_maps(generator(351), 60, 2, 320, 240)
    whole = fit_pair(maps)
    sides = [fit_pair([one, one]) for one in maps]
    assert whole.error.max_px == max(side.error.max_px for side in sides)
    assert whole.error.rms_px == pytest.approx(math.hypot(*(side.error.rms_px for side in sides))/math.sqrt(2))
    assert whole.rows == whole.budget.rows(LEAD) and whole.rows >= max(side.rows for side in sides)
    assert whole.delay_rows == max(whole.budget.delay, 0)


def test_the_name_of_grids():
    """The CRC-32 of all nodes, as little-endian words, left camera first."""
    nodes = generator(352).integers(-100, 100, (2, *grid_shape(40, 30), 2)).astype(np.int16)
    grids = [Grid(40, 30, one) for one in nodes]
    assert grid_crc(grids) != grid_crc(grids[::-1])
    nodes = np.arange(2*3*4*2).reshape(2, 3, 4, 2).astype(np.int16)
    # As python3 -c 'import zlib, struct; print(hex(zlib.crc32(struct.pack("<48h", *range(48)))))' prints it.
    assert grid_crc([Grid(33, 17, one) for one in nodes]) == 0xc2cdca62


def test_halves_do_not_depend_on_the_last_bits():
    """A displacement between two steps of a node goes to the same one after a change of its last bits."""
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
    for change in (0, 1e-12, -1e-12):
        grids = fit_pair([(columns + 0.5/128 + change, rows + 2.5/128 + change)]*2).grids
        assert (grids[0].nodes[..., 0] == 0).all() and (grids[0].nodes[..., 1] == 2).all()


# Boards.

def blocks(rows, width):
    """Return the block RAMs of two rings, and of both cameras' grids at 480 rows."""
    nodes = math.prod(grid_shape(width, 480))
    return 2*4*math.ceil(rows//2*math.ceil(width/2)/2048) + 2*math.ceil(2*nodes/512)


def test_boards_have_room():
    """Each board has block RAM to spare for its rows, and no board for more; the page has the same numbers."""
    page = (CHECKOUT/"docs"/"rectification.md").read_text(encoding="utf-8")
    rows = re.findall(r"(?m)^\| [\w -]+ \| (\d+)(?:, halves of a block)? \| (\d+|none) \|$", page)
    assert sorted((int(spare), 0 if most == "none" else int(most)) for spare, most in rows) == sorted(
        (room.blocks, room.rows) for room in BUILDS.values())
    for name, room in BUILDS.items():
        assert room.rows == 0 or LEAST_ROWS <= room.rows <= MOST_ROWS and room.rows % 2 == 0, name
        assert room.rows == 0 or blocks(room.rows, room.width) <= room.blocks, name
        assert room.rows == MOST_ROWS or blocks(room.rows + 2 if room.rows else LEAST_ROWS, room.width) > room.blocks


def test_boards_by_rows():
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32))

    def boards(below):
        return boards_with_room(fit_pair([(columns, rows), (columns, rows + below)]))

    assert boards(0) == boards(18) == ["colorlight_i9", "ulx3s", "ecpix5", "arty", "atlys"]
    assert boards(20) == boards(44) == ["ulx3s", "ecpix5", "arty", "atlys"]
    assert boards(46) == boards(58) == ["ulx3s", "ecpix5", "arty"]
    assert boards(60) == boards(90) == ["ulx3s", "ecpix5"]
    assert boards(92) == []
