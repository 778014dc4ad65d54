#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From costs to a disparity: emitted Verilog of each core against the models of the stages."""

from __future__ import annotations

import numpy as np
import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream

from litestereo.gateware.common import delayed
from litestereo.gateware.common.parameters import FEATURES, MatcherParameters
from litestereo.gateware.post.selection.cost_delay import CostDelay
from litestereo.gateware.post.selection.selection import Selection
from litestereo.gateware.post.selection.subpixel import Neighbours, Subpixel
from litestereo.gateware.post.selection.uniqueness import CostLimit, Uniqueness, reciprocal
from litestereo.gateware.post.selection.winner import Winner
from litestereo.sim.models import stages
from support.core_bench import CoreBench
from support.limits import Range, setting_ranges
from support.pairs import generator

RATIOS, THRESHOLDS = (setting_ranges()[name] for name in ("uniqueness_ratio", "texture_threshold"))


def parameters(disparities, features=FEATURES):
    """Return the parameters of a matcher of that size."""
    return MatcherParameters(max_width=disparities + 40, disparities=disparities, max_block_size=9, features=features)


def drawn_costs(rng, count, lanes, most):
    """Return costs with many ties and near ties, N x lanes; the first ones are saturated."""
    costs       = rng.integers(0, most + 1, (count, lanes))
    few         = count//3
    costs[:few] = rng.choice([0, 1, 2, 3, most - 1, most], (few, lanes))
    costs[few:few + 30] = rng.choice(Range(0, most).limits, (30, lanes))
    # Smooth costs, as of real images, whose winner may be unique.
    centre      = rng.integers(0, lanes, (few, 1))
    costs[-few:] = np.minimum(most, np.abs(np.arange(lanes) - centre)*rng.integers(0, 40, (few, 1))
                              + rng.integers(0, 100, (few, 1)) + rng.integers(0, 3, (few, lanes)))
    costs[:5]   = most
    return costs


@pytest.mark.parametrize("disparities", [16, 48, 64, 112])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_winner(disparities, valid):
    """Of equal costs the largest disparity wins; unused lanes never win."""
    rng   = generator(5, disparities)
    built = parameters(disparities)
    bench = CoreBench(Winner(built), ["disparities"])
    most  = built.max_block_size**2*built.largest_pixel
    for used in range(16, disparities + 1, 16):
        costs = drawn_costs(rng, 300, disparities, most)
        costs[10:20, :used] = most
        bench.set(disparities=used)
        bench.interrupt({"costs": costs}, clock=int(rng.integers(2, len(costs))))
        out         = bench.run({"costs": costs}, len(costs), valid)
        index, cost = stages.winners(costs[:, :used].T)
        assert np.array_equal(out["index"], index)
        assert np.array_equal(out["cost"], cost)


@pytest.mark.parametrize("largest", [1, 24, 25, 2**14 - 1, (2**16 - 1)*25, (2**18 - 1)*25])
def test_reciprocal(largest):
    """The division is exact up to the largest number, especially around multiples of the divisor."""
    factor, shift = reciprocal(25, largest)
    numbers = np.unique(np.concatenate([np.arange(min(largest, 5000) + 1), *(
        np.arange(largest//25 + 1)*25 + offset for offset in (0, 24))]))
    numbers = numbers[numbers <= largest].astype(object)
    assert (numbers*factor >> shift == numbers//25).all()


@pytest.mark.parametrize("max_block_size", [9, 31])
def test_cost_limit(max_block_size):
    """The limit is cost + floor(cost*ratio/100) for every ratio, at the ends and in between."""
    rng   = generator(9)
    built = MatcherParameters(max_width=128, disparities=16, max_block_size=max_block_size)
    most  = built.max_block_size**2*built.largest_pixel
    bench = CoreBench(CostLimit(built), ["ratio"])
    for ratio in range(RATIOS.least, RATIOS.most + 1):
        costs = np.concatenate([np.arange(102), most - np.arange(102), Range(0, most).limits,
                                rng.integers(0, most + 1, 300)])
        bench.set(ratio=ratio)
        assert np.array_equal(bench.run({"cost": costs}, len(costs))["limit"], costs + costs*ratio//100), ratio


@pytest.mark.parametrize("disparities", [16, 48, 128])
def test_uniqueness(disparities):
    """A rival is a cost within the limit that is no neighbour of the winner; unused lanes are no rivals."""
    rng   = generator(10, disparities)
    built = parameters(disparities)
    most  = built.max_block_size**2*built.largest_pixel
    bench = CoreBench(Uniqueness(built), ["disparities"])
    for used in sorted({16, disparities}):
        for ratio in (*RATIOS.ends[1:], 5, 50):
            costs       = drawn_costs(rng, 300, disparities, most)
            index, cost = stages.winners(costs[:, :used].T)
            bench.set(disparities=used)
            out = bench.run({"costs": costs, "index": index, "limit": cost + cost*ratio//100}, len(costs), 0.7)
            assert np.array_equal(out["unique"], stages.uniqueness_mask(costs[:, :used].T, index, ratio))


@pytest.mark.parametrize("disparities", [16, 48, 64, 128])
def test_neighbours(disparities):
    """Every winner has its two neighbours; at the ends the one that exists."""
    rng   = generator(11, disparities)
    bench = CoreBench(Neighbours(parameters(disparities)))
    index = np.arange(disparities)
    costs = rng.integers(0, 2**14, (disparities, disparities))
    out   = bench.run({"costs": costs, "index": index}, disparities, 0.7)
    assert np.array_equal(out["below"][1:],  costs[index[1:], index[1:] - 1])
    assert np.array_equal(out["above"][:-1], costs[index[:-1], index[:-1] + 1])


def test_subpixel():
    """Costs whose middle is a minimum, the ends of the range, and the switched-off stage give the model's result."""
    rng   = generator(12)
    built = parameters(32)
    most  = built.max_block_size**2*built.largest_pixel
    bench = CoreBench(Subpixel(built), ["disparities", "enable"])
    count = 4000
    cost  = rng.choice([*Range(0, most).limits, most//2, *rng.integers(0, most, 50)], count)
    below, above = (np.minimum(most, cost + rng.choice([0, 1, 2, 3, most, *rng.integers(0, most, 50)], count))
                    for _ in range(2))
    index = rng.integers(0, 16, count)
    # As the model requires: all costs of a pixel, of which only three matter.
    costs = np.full((16, count), most)
    for step, values in ((0, cost), (-1, below), (1, above)):
        inside = (index + step >= 0) & (index + step < 16)
        costs[(index + step)[inside], np.flatnonzero(inside)] = values[inside]
    fields = {"index": index, "cost": cost, "below": below, "above": above}
    bench.set(disparities=16, enable=1)
    bench.interrupt(fields, clock=100)
    assert np.array_equal(bench.run(fields, count, 0.7)["disparity"], stages.subpixel(costs, index, 0))
    bench.set(enable=0)
    assert np.array_equal(bench.run(fields, count)["disparity"], index*16)


class DelayStream(LiteXModule):
    """A cost delay with endpoints instead of its Signals."""
    def __init__(self, built, latency):
        self.delay   = delay = CostDelay(built, latency)
        self.latency = latency
        self.sink    = stream.Endpoint([("costs", len(delay.sink))])
        self.source  = stream.Endpoint([("costs", len(delay.source))])
        self.comb   += [
            delay.sink.eq(self.sink.costs),
            self.source.costs.eq(delay.source),
            self.source.valid.eq(delayed(self, self.sink.valid, latency)),
        ]


@pytest.mark.parametrize("latency", [4, 5, 13])
def test_cost_delay(latency):
    """An item comes out that many clocks later."""
    built = parameters(16)
    bench = CoreBench(DelayStream(built, latency), lanes={"costs": 16})
    costs = generator(13, latency).integers(0, 2**built.cost_bits, (200, 16))
    assert np.array_equal(bench.run({"costs": costs}, 200, 0.7)["costs"], costs)


FEATURE_SETS = [FEATURES, ["raw"], ["xsobel", "texture"], ["raw", "uniqueness"], ["xsobel", "subpixel"]]


@pytest.mark.parametrize("features", FEATURE_SETS, ids="-".join)
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_whole_selection(features, valid):
    """All stages together give the model's result, with any features built; only complete blocks come out."""
    rng   = generator(14, len(features))
    built = parameters(32, features)
    most  = built.max_block_size**2*built.largest_pixel
    bench = CoreBench(Selection(built), ["disparities", "texture_threshold", "uniqueness_ratio", "subpixel"])
    cases = [(32, 0, 0, 1), (16, 200, 10, 1), (32, 60, 100, 0), (32, 1, 99, 0), (16, most, 1, 1), (32, most + 1, 15, 1)]
    cases += [(32, threshold, ratio, 1) for threshold, ratio in zip(THRESHOLDS.ends, RATIOS.ends, strict=True)]
    for used, threshold, ratio, fine in cases:
        costs    = drawn_costs(rng, 400, 32, most)
        texture  = rng.choice([0, 1, 59, 60, 199, 200, most - 1, most], len(costs))
        complete = rng.integers(0, 2, len(costs))
        lanes    = np.column_stack([costs, texture]) if "texture" in features else costs
        bench.set(disparities=used, texture_threshold=threshold, uniqueness_ratio=ratio, subpixel=fine)
        bench.interrupt({"costs": lanes, "complete": complete}, clock=int(rng.integers(2, len(costs))))
        out         = bench.run({"costs": lanes, "complete": complete}, int(complete.sum()), valid)
        chosen      = costs[complete == 1, :used].T
        index, cost = stages.winners(chosen)
        found       = np.ones(len(index), bool)
        if "uniqueness" in features:
            found &= stages.uniqueness_mask(chosen, index, ratio)
        if "texture" in features:
            found &= texture[complete == 1] >= threshold
        fractions = stages.subpixel(chosen, index, 0) if fine and "subpixel" in features else index*16
        assert np.array_equal(out["found"], found)
        assert np.array_equal(out["disparity"], fractions)
        assert np.array_equal(out["cost"], cost)
