#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The cores that lay out the map: emitted Verilog against NumPy and OpenCV, with back-pressure on both sides."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.post.border import Border
from litestereo.gateware.post.median import Median
from litestereo.sim.models.stages import median3x3
from support.core_bench import SMALL, CoreBench
from support.limits import Draws, Range
from support.pairs import generator

FLOWS = [(1.0, 1.0), (0.4, 1.0), (1.0, 0.4), (0.6, 0.6)]


def check_marks(bench, pixels):
    """Check that first and last are marked, and no others."""
    first, last = bench.marks
    assert first.nonzero()[0].tolist() == [0]
    assert last.nonzero()[0].tolist() == [pixels - 1]


@pytest.mark.parametrize("valid, ready", FLOWS)
def test_border(valid, ready):
    """The valid region has a border of invalid pixels; pixels without a match are invalid too."""
    rng      = generator(18)
    settings = ["width", "height", "disparities", "min_disparity", "block_size", "begin"]
    bench    = CoreBench(Border(SMALL), settings, pipeline=False)
    for width, height, block_size, min_disparity in [(20, 5, 5, 0), (44, 12, 9, 0), (37, 11, 7, 3), (30, 9, 5, 10),
                                                     (21, 6, 5, 1), (43, 6, 5, 23), (44, 9, 9, 20), (44, 5, 5, 24)]:
        margin = block_size//2
        valid_region = np.zeros((height, width), bool)
        valid_region[margin:height - margin, min_disparity + 15 + margin:width - margin] = True
        count    = int(valid_region.sum())
        items    = {"found": rng.integers(0, 2, count),
                    "disparity": rng.choice([*Range(0, 240).limits, *range(241)], count)}
        bench.begin(width=width, height=height, disparities=16, min_disparity=min_disparity, block_size=block_size)
        out      = bench.run(items, width*height, valid, ready)
        expected = np.full((height, width), 16*(min_disparity - 1))
        expected[valid_region] = np.where(items["found"] == 1, items["disparity"] + 16*min_disparity,
                                          16*(min_disparity - 1))
        assert np.array_equal(out["disparity"].astype(np.uint16).view(np.int16), expected.ravel())
        assert bench.taken == count
        check_marks(bench, width*height)
        bench.core.reset()


@pytest.mark.parametrize("valid, ready", FLOWS)
def test_median(valid, ready):
    """Negative and positive values, ties, smallest sizes, frames back to back and a reset give OpenCV's map."""
    rng   = generator(19)
    bench = CoreBench(Median(SMALL), ["width", "height", "median", "begin"], pipeline=False)
    draws = Draws(rng, {"width": Range(20, SMALL.max_width), "height": Range(5, 20)})
    for number in range(20):
        width, height = draws("width"), draws("height")
        pixels = rng.choice([-16, -16, 0, 5, *range(-16, 2000, 37)], (height, width)).astype(np.int16)
        if number % 4 == 3:
            whole  = Range(-2**15, 2**15 - 1)
            pixels = rng.choice([*whole.limits, *rng.integers(whole.least, whole.most + 1, 50)],
                                (height, width)).astype(np.int16)
        items = {"disparity": pixels.view(np.uint16).ravel()}
        if number % 3 == 1:
            bench.begin(width=width, height=height, median=1)
            bench.interrupt(items, clock=int(rng.integers(2, width*height)))
        bench.begin(width=width, height=height, median=1)
        out = bench.run(items, width*height, valid, ready)["disparity"].astype(np.uint16).view(np.int16)
        assert np.array_equal(out.reshape(height, width), median3x3(pixels))
        check_marks(bench, width*height)
    draws.check()


def test_median_off():
    """The map passes unchanged."""
    bench  = CoreBench(Median(SMALL), ["width", "height", "median", "begin"], pipeline=False)
    pixels = np.arange(100)
    bench.begin(width=20, height=5, median=0)
    assert np.array_equal(bench.run({"disparity": pixels}, 100, 0.6, 0.6)["disparity"], pixels)
