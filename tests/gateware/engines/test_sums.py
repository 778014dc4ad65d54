#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Sums over columns and blocks: each core's emitted Verilog against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.engines.sad.block_sum import BlockSum
from litestereo.gateware.engines.sad.column_sum import ColumnSum
from support.core_bench import SMALL, CoreBench
from support.lanes import steps
from support.limits import Range
from support.pairs import generator

LANES, LARGEST = SMALL.lanes, SMALL.largest_pixel


def cost_steps(rng, block_size, count=3):
    """Yield frames as (rows, cost columns, fields of the steps that have a cost), the smallest first."""
    for index in range(count):
        outer  = block_size//2*(index % 2)
        width  = SMALL.max_width if index else SMALL.disparities + block_size - 1
        height = block_size + 5 if index else block_size
        place  = steps(width, height, SMALL.disparities, block_size, 0, outer)
        costs  = place["cost"] == 1
        yield height, width - SMALL.disparities + 1 + 2*outer, {name: values[costs] for name, values in place.items()}


def as_differences(rng, magnitudes):
    """Return magnitudes as lanes of `AbsoluteDifference`: a negative difference lacks 1, and its top bit is that 1."""
    negative = rng.integers(0, 2, magnitudes.shape)*(magnitudes > 0)
    return (magnitudes - negative + (negative << SMALL.filtered_bits)).reshape(-1, LANES)


@pytest.mark.parametrize("block_size", [5, 9])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_column_sum(block_size, valid):
    """A column's sum is that of its last block_size rows, also for saturated input."""
    rng   = generator(3, block_size)
    bench = CoreBench(ColumnSum(SMALL), lanes={"sums": LANES})
    for height, columns, place in cost_steps(rng, block_size):
        enter = rng.choice([*Range(0, LARGEST).limits, *range(LARGEST + 1)], (height, columns, LANES))
        enter[:, :, 0] = LARGEST
        leave = rng.integers(0, LARGEST + 1, enter.shape)  # Before row block_size the line buffer may return anything.
        leave[block_size:] = enter[:max(0, height - block_size)]
        items = {"enter": as_differences(rng, enter), "leave": as_differences(rng, leave)} | place
        bench.interrupt(items, clock=int(rng.integers(2, height*columns)))
        out = bench.run(items, height*columns, valid)["sums"].reshape(enter.shape)
        for row in range(height):
            assert np.array_equal(out[row], enter[max(0, row - block_size + 1):row + 1].sum(axis=0)), row


@pytest.mark.parametrize("block_size", [5, 9])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_block_sum(block_size, valid):
    """A block's cost is the sum of its last block_size columns in the row."""
    rng   = generator(4, block_size)
    bench = CoreBench(BlockSum(SMALL), ["block_size"], lanes={"costs": LANES})
    for height, columns, place in cost_steps(rng, block_size):
        most = SMALL.max_block_size*LARGEST
        sums = rng.choice([*Range(0, most).limits, *rng.integers(0, most + 1, 50)], (height, columns, LANES))
        sums[:, :, 0] = most
        bench.set(block_size=block_size)
        items = {"sums": sums.reshape(-1, LANES)} | place
        bench.interrupt(items, clock=int(rng.integers(2, height*columns)))
        out = bench.run(items, height*columns, valid)["costs"].reshape(sums.shape)
        for column in range(columns):
            expected = sums[:, max(0, column - block_size + 1):column + 1].sum(axis=1)
            assert np.array_equal(out[:, column], expected), column
