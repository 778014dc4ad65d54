#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Drawn cameras: maps of OpenCV, their fitted grids, and the rectifier's emitted Verilog against cv2.remap."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.host_tools.core.grid import fit_grid, row_budget
from support.pairs import generator
from support.rectification_maps import drawn_pair
from support.rectifier_bench import EVEN, Flow, RectifierBench, images_of
from support.rigs import KINDS, drawn_maps

#: Clocks of a frame on top of those of its pixels.
FIXED_CLOCKS = 60


@pytest.fixture(scope="module")
def small():
    """Return a rectifier for small frames in Verilator, that of test_rectifier."""
    return RectifierBench(RectifierParameters(max_width=64, max_height=48, rows=24))


@pytest.fixture(scope="module")
def large():
    """Return a rectifier for 640 x 480 in Verilator."""
    return RectifierBench(RectifierParameters(max_width=640, max_height=480, rows=96))


def check_rig(bench, grids, raws, lead, flow=EVEN):
    """Rectify frames that follow one another, and compare all with cv2.remap of the grids' maps; return the clocks."""
    width, height = grids[0].width, grids[0].height
    assert bench.load(0, [grid.nodes for grid in grids]) == 0
    bench.set(width, height, lead)
    pixels = len(raws)*width*height
    # The last rows of the last frame come in when all of its pixels have left.
    result = bench.run(raws, pixels + 1, flow)
    assert (len(result.words), result.accepted) == (pixels, pixels)
    for got, raw in zip(images_of(result.words, width, height), raws, strict=True):
        for image, raw_image, grid in zip(got, raw, grids, strict=True):
            assert np.array_equal(image, cv2.remap(raw_image, *grid.opencv_maps(), cv2.INTER_LINEAR))
    assert not bench.core.get("row_gone") and not bench.core.get("folded")
    return result.clocks


@pytest.mark.parametrize("degrees", [0.5, 5])
@pytest.mark.parametrize("kind", KINDS)
def test_small_rigs(small, kind, degrees):
    """Lenses of 44 to 90 degrees and fisheyes, straight and misaligned: every pixel is that of cv2.remap."""
    rng    = generator(320, int(10*degrees))
    grids  = [fit_grid(maps) for maps in drawn_maps(rng, kind, degrees, 64, 48)]
    budget = row_budget(grids)
    lead   = min(max(budget.delay, 2), 24 - budget.rows(0))
    budget.check(24, lead)
    clocks = check_rig(small, grids, [drawn_pair(64, 48, rng)], lead)
    assert clocks <= 1.03*64*(48 + max(budget.delay, lead)) + FIXED_CLOCKS
    check_rig(small, grids, [drawn_pair(64, 48, rng) for _ in range(2)], lead, Flow(0.7, 0.7))


@pytest.mark.long
@pytest.mark.parametrize("degrees", [1, 3, 5])
@pytest.mark.parametrize("kind", KINDS)
def test_large_rigs(large, kind, degrees):
    """At 640 x 480 too, and a frame takes 1.03 clocks per pixel at most, those before its first row included."""
    rng    = generator(321, degrees)
    grids  = [fit_grid(maps) for maps in drawn_maps(rng, kind, degrees, 640, 480)]
    budget = row_budget(grids)
    budget.check(96, 2)
    lead   = min(max(budget.delay, 2), 96 - budget.rows(0))
    clocks = check_rig(large, grids, [drawn_pair(640, 480, rng)], lead)
    assert clocks <= 1.03*640*(480 + max(budget.delay, lead))


@pytest.mark.long
def test_large_frames_back_to_back(large):
    """With enough rows, frames that follow one another take 1.05 clocks per pixel at most."""
    rng    = generator(322)
    grids  = [fit_grid(maps) for maps in drawn_maps(rng, 44, 1, 640, 480)]
    budget = row_budget(grids)
    lead   = budget.steady_lead
    budget.check(96, lead)
    clocks = check_rig(large, grids, [drawn_pair(640, 480, rng) for _ in range(4)], lead)
    assert clocks <= 640*(1.03*(480 + lead) + 3*1.05*480)
