#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Drawn rigs through `cosim:`: the pair is that of cv2.remap, and the map that of cv2.StereoBM, on every pixel."""

from __future__ import annotations

import os
from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from litestereo.gateware.common.parameters import FEATURES, MatcherParameters
from litestereo.host_tools.core.errors import GeometryError, UnsupportedError
from litestereo.host_tools.core.grid import LEAD, GridPair, fit_grid, row_budget
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.devices.local import GatewareRectification
from support.opencv import same_as_opencv
from support.pairs import generator
from support.rigs import RigDraws, drawn_maps, raw_pair
from support.settings import OpenCVDraws

#: Number of drawn rigs; `make sweep` draws more.
RIGS  = int(os.environ.get("LITESTEREO_RIGS", "12"))
PARTS = 2

#: Rows of the rings of `cosim:`, and of a smaller build.
ROWS, FEW_ROWS = 96, 64

WIDTH, HEIGHT, DISPARITIES, BLOCK = 640, 480, 32, 11


@dataclass(frozen=True)
class Case:
    """Numbers of a rig, and settings for its pair."""
    kind:     int | str
    degrees:  float
    width:    int
    height:   int
    settings: MatcherSettings


def cases() -> list[Case]:
    """Draw all cases: all tests draw the same ones."""
    rng      = generator(340)
    rigs     = RigDraws(rng, WIDTH)
    settings = OpenCVDraws(rng, disparities=DISPARITIES, block_size=BLOCK, min_disparity=16)
    drawn    = [Case(*rigs.rig(), settings.settings()) for _ in range(RIGS)]
    if RIGS >= 12:
        rigs.check()
        settings.check()
    return drawn


def scene(width: int, height: int, shift: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a smooth texture as both cameras see it, `shift` pixels apart, rectified."""
    blurred = cv2.GaussianBlur(rng.integers(0, 256, (height, width + shift)).astype(np.float32), (0, 0), 1.2)
    texture = np.clip(128 + 4*(blurred - 128), 0, 255).astype(np.uint8)
    return texture[:, :width], texture[:, shift:]


def drawn_grids(rng: np.random.Generator, kind: int | str, degrees: float, width: int, height: int) -> GridPair:
    """Return the grids of a rig that has no fold."""
    while True:
        try:
            left, right = (fit_grid(maps) for maps in drawn_maps(rng, kind, degrees, width, height))
        except GeometryError:
            continue
        return left, right


def refusal(rows: int, built: int) -> str:
    """Return what a build of so many rows says of grids that need `rows`; empty if it can use them."""
    return "" if rows <= built else (f"the map needs {rows} rows of the images at once, this build keeps {built}")


def small_build() -> GatewareRectification:
    """Return a rectification that keeps fewer rows; it is not compiled."""
    return GatewareRectification(MatcherParameters(
        WIDTH, disparities=DISPARITIES, max_block_size=BLOCK, features=(*FEATURES, "rectification"),
        rectification_rows=FEW_ROWS, rectification_height=HEIGHT))


@pytest.fixture(scope="module")
def device():
    """Return the device `cosim:`, wide enough for all rigs."""
    # Counting lines doubles the time, and other tests run the same lines.
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("LITESTEREO_COVERAGE", raising=False)
        with connect(f"cosim:?max_width={WIDTH}&disparities={DISPARITIES}&max_block_size={BLOCK}") as opened:
            yield opened


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
def test_drawn_rigs(device, part):
    """Lenses of 44 to 90 degrees and fisheyes, up to 5 degrees off, of any size: every pixel is OpenCV's.

    A rig that needs more rows than are built is refused with both numbers, and drawn again.
    """
    few     = small_build()
    found   = []
    refused = 0
    for number, case in list(enumerate(cases()))[part::PARTS]:
        print(number, case)
        rng = generator(341, number)
        raw = np.zeros((2, case.height, case.width), np.uint8)
        while True:
            grids = drawn_grids(rng, case.kind, case.degrees, case.width, case.height)
            rows  = row_budget(grids).rows(LEAD)
            assert few.gap(grids) == refusal(rows, FEW_ROWS)
            if rows <= ROWS:
                break
            refused += 1
            assert refused < RIGS
            with pytest.raises(UnsupportedError, match=refusal(rows, ROWS)):
                device.compute(*raw, case.settings, grids=grids)
        shift    = case.settings.min_disparity + int(rng.integers(0, case.settings.disparities))
        raw      = raw_pair(scene(case.width, case.height, shift, rng), grids, rng)
        result   = device.compute(*raw, case.settings, grids=grids, images=("left", "right"))
        expected = [cv2.remap(image, *grid.opencv_maps(), cv2.INTER_LINEAR)
                    for image, grid in zip(raw, grids, strict=True)]
        assert np.array_equal(result.left, expected[0]) and np.array_equal(result.right, expected[1])
        same_as_opencv(result.disparity, *expected, case.settings)
        found.append(float(np.mean(abs(result.disparity/16 - shift) <= 1)))
    # Not all maps are empty: a setting may well remove all disparities.
    assert max(found) > 0.3, found


def test_rows_of_rigs():
    """Of rigs misaligned by five degrees one fits 96 rows, and a build of 64 rows refuses it with both numbers."""
    rng = generator(342)
    few = small_build()
    for _ in range(12):
        grids = drawn_grids(rng, 44, 5, WIDTH, HEIGHT)
        rows  = row_budget(grids).rows(LEAD)
        assert few.gap(grids) == refusal(rows, FEW_ROWS)
        if FEW_ROWS < rows <= ROWS:
            return
    raise AssertionError("no rig needs so many rows")
