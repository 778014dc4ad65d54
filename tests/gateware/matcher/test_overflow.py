#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The largest possible sums, all black against all white, in the emitted Verilog: no bit is lost."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.common.parameters import MAX_BLOCK_SIZE, MIN_BLOCK_SIZE, MatcherParameters
from litestereo.gateware.engines.sad.block_sum import BlockSum
from litestereo.gateware.engines.sad.column_sum import ColumnSum
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.cores.cosim import CosimMatcher
from litestereo.sim.models.stereo_bm import stereo_bm
from support.core_bench import CoreBench
from support.lanes import steps

DISPARITIES, WHITE = 16, 255


def built(block_size):
    """Return a matcher of that largest block, without prefilter."""
    return MatcherParameters(DISPARITIES + 2*MAX_BLOCK_SIZE, 100, DISPARITIES, block_size, ["raw"])


def cost_steps(parameters, block_size):
    """Yield rows, columns, and fields of the steps with a cost, of a frame with room for a few whole blocks."""
    width, height = DISPARITIES + block_size + 3, block_size + 3
    place = steps(width, height, DISPARITIES, block_size, ahead=parameters.ahead)
    costs = place["cost"] == 1
    return height, width - DISPARITIES + 1, {name: values[costs] for name, values in place.items()}


@pytest.mark.parametrize("block_size", [MIN_BLOCK_SIZE, MAX_BLOCK_SIZE])
def test_column_sum(block_size):
    """Every sum is exact, from the first row to rows after a whole block."""
    parameters = built(block_size)
    bench      = CoreBench(ColumnSum(parameters), lanes={"sums": parameters.lanes})
    height, columns, place = cost_steps(parameters, block_size)
    white = np.full((height*columns, parameters.lanes), WHITE)
    out   = bench.run({"enter": white, "leave": white} | place, height*columns)["sums"]
    rows  = np.minimum(np.arange(height) + 1, block_size)
    assert out.max() == block_size*WHITE
    assert np.array_equal(out.reshape(height, -1), np.repeat(rows*WHITE, columns*parameters.lanes).reshape(height, -1))


@pytest.mark.parametrize("block_size", [MIN_BLOCK_SIZE, MAX_BLOCK_SIZE])
def test_block_sum(block_size):
    """Every cost is exact, from the first column to columns after a whole block."""
    parameters = built(block_size)
    bench      = CoreBench(BlockSum(parameters), ["block_size"], lanes={"costs": parameters.lanes})
    height, columns, place = cost_steps(parameters, block_size)
    bench.set(block_size=block_size)
    full  = np.full((height*columns, parameters.lanes), block_size*WHITE)
    out   = bench.run({"sums": full} | place, height*columns)["costs"].reshape(height, columns, -1)
    count = np.minimum(np.arange(columns) + 1, block_size)
    assert out.max() == block_size**2*WHITE
    assert (out == (count*block_size*WHITE)[None, :, None]).all()


@pytest.mark.long
def test_all_black_against_all_white():
    """The whole matcher is exact at the largest block; a few columns that cost slightly less win."""
    size     = DISPARITIES + 2*MAX_BLOCK_SIZE
    black    = np.zeros((size, size), np.uint8)
    grey     = np.full_like(black, WHITE)
    matcher  = CosimMatcher(MatcherParameters(size, disparities=DISPARITIES, max_block_size=MAX_BLOCK_SIZE))
    # The largest cost that fits in one bit less lies between those of blocks with and without the grey columns: a cost
    # that wraps around would win.
    limit    = 2**(built(MAX_BLOCK_SIZE).cost_bits - 1)
    white    = limit//MAX_BLOCK_SIZE**2 + 1
    better   = np.full_like(black, white)
    better[:, size//2:size//2 + MAX_BLOCK_SIZE] = white - 2
    for prefilter, ratio in [("none", 0), ("none", 100), ("xsobel", 0)]:
        settings = MatcherSettings(DISPARITIES, MAX_BLOCK_SIZE, prefilter=prefilter, prefilter_cap=63,
                                  texture_threshold=0, uniqueness_ratio=ratio)
        for left, right in [(black, grey), (grey, black), (black, better), (better, black)]:
            expected = stereo_bm(left, right, settings)
            assert np.array_equal(matcher.match_settings(left, right, settings)[0], expected)
    assert MAX_BLOCK_SIZE**2*(white - 2) < limit < MAX_BLOCK_SIZE**2*white
    matcher.close()
