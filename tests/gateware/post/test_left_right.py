#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The left-right check: emitted Verilog of its cores against a dictionary, and against the model of the stage."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.common.parameters import MAX_DISP12_MAX_DIFF, MatcherParameters
from litestereo.gateware.post.left_right.left_right import LeftRight
from litestereo.sim.models.stages import Columns, left_right_check
from support.core_bench import CoreBench
from support.limits import Draws, Range, setting_ranges
from support.pairs import generator

BUILT    = MatcherParameters(max_width=90, max_height=100, disparities=32, max_block_size=11)
#: Ranges of the settings, the check always on, and of what a row has beyond its smallest width.
RANGES = setting_ranges(disparities=BUILT.disparities, block_size=BUILT.max_block_size) | {
    "min_disparity":   Range(0, BUILT.max_width - BUILT.disparities - BUILT.max_block_size + 1),
    "disp12_max_diff": Range(0, MAX_DISP12_MAX_DIFF),
    "more_columns":    Range(0, BUILT.max_width - 16 - 5 + 1)}
DRAWN = ("disparities", "block_size", "min_disparity", "disp12_max_diff", "more_columns")
SETTINGS = ["width", "disparities", "min_disparity", "outer", "left_right", "disp12_max_diff", "begin"]


def drawn_rows(rng, rows, count, disparities, kind):
    """Draw found, disparity (sixteenths, relative) and cost of the winners, rows x count."""
    found     = rng.random((rows, count)) < (0.8 if kind != "nothing found" else 0)
    disparity = rng.integers(0, 16*(disparities - 1) + 1, (rows, count))
    cost      = rng.integers(0, 3000, (rows, count))
    if kind == "whole pixels":
        disparity = disparity//16*16
    elif kind == "one column":
        # All lead to one place, as far as possible, so that votes for it are consecutive.
        whole     = np.clip(np.arange(count) - count//2 + disparities//2, 0, disparities - 1)
        disparity = np.minimum(16*whole + rng.integers(0, 8, (rows, count)), 16*(disparities - 1))
        cost      = rng.integers(0, 4, (rows, count))
    elif kind == "ties":
        disparity = rng.choice([0, 16, 32, 40], (rows, count))
        cost      = rng.choice([5, 5, 6], (rows, count))
    elif kind == "at the limit":
        # Winners that differ by whole pixels, and by a sixteenth more.
        disparity = rng.choice([0, 1, 16, 17, 32, 33], (rows, count))
    return found.astype(np.int64), disparity, cost


@pytest.mark.parametrize("valid, ready", [(1.0, 1.0), (0.4, 1.0), (1.0, 0.4), (0.7, 0.7)])
def test_left_right(valid, ready):
    """Rows of every kind, frame after frame, give the model's result; the outer winners are not in it."""
    rng   = generator(15)
    bench = CoreBench(LeftRight(BUILT), SETTINGS, pipeline=False)
    draws = Draws(rng, {name: RANGES[name] for name in DRAWN}, {"disp12_max_diff": [0, 1, 2, 4]})
    for number in range(48):
        kind          = ["drawn", "whole pixels", "one column", "ties", "at the limit", "nothing found"][number % 6]
        disparities, block_size, min_disparity, difference, more = (draws(name) for name in DRAWN)
        outer         = block_size//2
        smallest      = disparities + min_disparity + block_size - 1
        width         = min(smallest + more, BUILT.max_width)
        columns       = Columns(width, disparities, min_disparity, block_size)
        rows          = int(rng.integers(1, 5))
        found, disparity, cost = drawn_rows(rng, rows, columns.count, disparities, kind)
        bench.begin(width=width, disparities=disparities, min_disparity=min_disparity, outer=outer, left_right=1,
                    disp12_max_diff=difference)
        out = bench.run({"found": found.ravel(), "disparity": disparity.ravel(), "cost": cost.ravel()},
                        rows*(columns.count - 2*outer), valid, ready)
        absolute = np.where(found == 1, disparity + 16*min_disparity, 16*(min_disparity - 1)).astype(np.int16)
        kept     = left_right_check(absolute, cost.astype(np.int32), difference, columns)
        inside   = slice(outer, columns.count - outer)
        expected = ((found == 1) & kept)[:, inside].ravel()
        assert np.array_equal(out["found"], expected), (kind, width, disparities, min_disparity, difference)
        assert np.array_equal(out["disparity"][expected], disparity[:, inside].ravel()[expected])
        assert (expected.any() or kind == "nothing found") and bench.taken == rows*columns.count
    draws.check()


@pytest.mark.parametrize("disparities", [16, 128])
def test_largest_differences(disparities):
    """Winners as far apart as can be, at every limit of the setting: also above the largest difference."""
    built   = MatcherParameters(max_width=2*disparities + 5, disparities=disparities, max_block_size=5)
    columns = Columns(built.max_width, disparities, 0, 5)
    bench   = CoreBench(LeftRight(built), SETTINGS, pipeline=False)
    # All winners from the third one on lead to one column; the one of the largest disparity is the best there.
    disparity = np.tile(16*np.clip(np.arange(columns.count) - 2, 0, disparities - 1), (2, 1))
    cost      = 1000 - disparity//16
    found     = np.ones_like(disparity)
    for difference in sorted({*RANGES["disp12_max_diff"].limits, disparities - 2}):
        bench.begin(width=built.max_width, disparities=disparities, min_disparity=0, outer=2, left_right=1,
                    disp12_max_diff=difference)
        out  = bench.run({"found": found.ravel(), "disparity": disparity.ravel(), "cost": cost.ravel()},
                         2*(columns.count - 4))
        kept = left_right_check(disparity.astype(np.int16), cost.astype(np.int32), difference, columns)[:, 2:-2]
        assert np.array_equal(out["found"], kept.ravel()), difference
        # The first of them differs by the whole range from the best one.
        assert kept[0, 0] == (difference >= disparities - 1)


def test_reset_in_mid_frame():
    """Votes from before a reset do not count."""
    rng   = generator(16)
    bench = CoreBench(LeftRight(BUILT), SETTINGS, pipeline=False)
    for number in range(30):
        columns = Columns(80, 32, 0, 5)
        found, disparity, cost = drawn_rows(rng, 4, columns.count, 32, "drawn")
        fields  = {"found": found.ravel(), "disparity": disparity.ravel(), "cost": cost.ravel()}
        begin   = {"width": 80, "disparities": 32, "min_disparity": 0, "outer": 2, "left_right": 1,
                   "disp12_max_diff": 0}
        bench.begin(**begin)
        bench.interrupt(fields | {"cost": np.zeros_like(fields["cost"])}, clock=10 + 9*number)
        bench.begin(**begin)
        out  = bench.run(fields, 4*(columns.count - 4))
        map_ = np.where(found == 1, disparity, -16).astype(np.int16)
        kept = left_right_check(map_, cost.astype(np.int32), 0, columns)
        assert np.array_equal(out["found"], ((found == 1) & kept)[:, 2:-2].ravel())


def test_switched_off():
    """Winners pass unchanged, between frames with the check."""
    rng   = generator(17)
    bench = CoreBench(LeftRight(BUILT), SETTINGS, pipeline=False)
    for _ in range(3):
        found, disparity, cost = drawn_rows(rng, 2, 40, 32, "drawn")
        fields = {"found": found.ravel(), "disparity": disparity.ravel(), "cost": cost.ravel()}
        bench.begin(width=71, disparities=32, min_disparity=0, outer=0, left_right=0, disp12_max_diff=0)
        out = bench.run(fields, 80, 0.6, 0.6)
        for name, values in fields.items():
            assert np.array_equal(out[name], values)
