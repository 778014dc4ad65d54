#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Each core's emitted Verilog against NumPy: gaps in the input, a reset in mid-frame, then the next frame."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.absolute_difference import AbsoluteDifference
from litestereo.gateware.block_sum import BlockSum
from litestereo.gateware.border import Border
from litestereo.gateware.column_sum import ColumnSum
from litestereo.gateware.line_buffer import LineBuffer
from litestereo.gateware.raster import Raster
from litestereo.gateware.winner import Winner
from litestereo.sim.stream_core import StreamCore
from support.lanes import pack, positions, unpack
from support.pairs import SEED, generator

WIDTH, HEIGHT, DISPARITIES, MAX_BLOCK = 37, 14, 16, 9
MAX_WIDTH = 40


class Bench:
    """A pipeline core that is fed whole frames and checked item by item."""
    def __init__(self, core, settings=(), lanes=None, source_lanes=None):
        self.module       = core
        self.core         = StreamCore(core, settings, pipeline=True)
        self.source_lanes = source_lanes

    def set(self, **settings):
        """Drive settings."""
        self.core.set(**settings)
        self.settle()

    def settle(self):
        """Some idle clocks: reset clears the thresholds that cores derive from their settings."""
        self.core.run(np.zeros((0, self.core.sink_words), np.uint32), 1, idle_clocks=4)

    def run(self, fields, outputs, valid):
        words  = pack(self.module.sink, fields)
        result = self.core.run(words, outputs, valid=valid, seed=SEED)
        assert len(result.words) == outputs
        return unpack(self.module.source, result.words, self.source_lanes)

    def interrupt(self, fields, clock):
        """Reset in mid-frame."""
        words = pack(self.module.sink, fields)
        self.core.run(words, len(words), valid=0.7, seed=SEED, reset_clock=clock)
        self.core.reset()
        self.settle()


def frames(rng, block_size, count=3):
    """Frames of random size for the settings, as (width, height, positions)."""
    for index in range(count):
        width  = WIDTH if index else DISPARITIES + block_size - 1
        height = HEIGHT if index else block_size
        yield width, height, positions(width, height, DISPARITIES, block_size)


def columns_of_raster(values, width, height):
    """N x lanes in raster order as height x width x lanes."""
    return np.asarray(values).reshape(height, width, -1)


@pytest.mark.parametrize("block_size", [5, 9])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_line_buffer(block_size, valid):
    """The pair that leaves is the one block_size rows above."""
    rng   = generator(1, block_size)
    bench = Bench(LineBuffer(MAX_WIDTH, MAX_BLOCK), ["width", "block_size"])
    for width, height, place in frames(rng, block_size):
        pixels = {name: rng.integers(0, 256, width*height) for name in ("left", "right")}
        bench.set(width=width, block_size=block_size)
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        out = bench.run(pixels | place, width*height, valid)
        for name in ("left", "right"):
            assert np.array_equal(out[name], pixels[name])
            assert np.array_equal(out[f"{name}_old"][width*block_size:], pixels[name][:-width*block_size or None]
                                  [:width*height - width*block_size])
        for name, values in place.items():
            assert np.array_equal(out[name], values)


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_absolute_difference(valid):
    """Lane d holds |left(x) - right(x - d)| for both rows."""
    rng   = generator(2)
    lanes = {"enter": DISPARITIES, "leave": DISPARITIES}
    bench = Bench(AbsoluteDifference(MAX_WIDTH, DISPARITIES), source_lanes=lanes)
    for width, height, place in frames(rng, 5):
        pixels = {name: rng.choice([0, 1, 127, 128, 254, 255, *range(256)], width*height)
                  for name in ("left", "right", "left_old", "right_old")}
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        out = bench.run(pixels | place, width*height, valid)
        for suffix, field in [("", "enter"), ("_old", "leave")]:
            left, right = (columns_of_raster(pixels[side + suffix], width, height)[..., 0]
                           for side in ("left", "right"))
            result      = columns_of_raster(out[field], width, height)
            for lane in range(DISPARITIES):
                expected = np.abs(left[:, lane:] - right[:, :width - lane])
                assert np.array_equal(result[:, lane:, lane], expected), (field, lane)


@pytest.mark.parametrize("block_size", [5, 9])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_column_sum(block_size, valid):
    """A column's sum is that of its last block_size rows, saturated input included."""
    rng   = generator(3, block_size)
    bench = Bench(ColumnSum(MAX_WIDTH, DISPARITIES, MAX_BLOCK), source_lanes={"sums": DISPARITIES})
    for width, height, place in frames(rng, block_size):
        enter = rng.choice([0, 255, *range(256)], (height, width, DISPARITIES))
        enter[:, :, 0] = 255
        leave = rng.integers(0, 256, enter.shape) # Before row block_size: anything, as from the line buffer.
        leave[block_size:] = enter[:-block_size or None][:height - block_size]
        items = {"enter": enter.reshape(-1, DISPARITIES), "leave": leave.reshape(-1, DISPARITIES)} | place
        bench.interrupt(items, clock=int(rng.integers(2, width*height)))
        out   = columns_of_raster(bench.run(items, width*height, valid)["sums"], width, height)
        for row in range(height):
            assert np.array_equal(out[row], enter[max(0, row - block_size + 1):row + 1].sum(axis=0)), row


@pytest.mark.parametrize("block_size", [5, 9])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_block_sum(block_size, valid):
    """A block's cost is the sum of its last block_size columns, within the row."""
    rng   = generator(4, block_size)
    bench = Bench(BlockSum(MAX_WIDTH, DISPARITIES, MAX_BLOCK), ["block_size"], source_lanes={"costs": DISPARITIES})
    for width, height, place in frames(rng, block_size):
        sums = rng.integers(0, MAX_BLOCK*255 + 1, (height, width, DISPARITIES))
        sums[:, :, 0] = MAX_BLOCK*255
        bench.set(block_size=block_size)
        items = {"sums": sums.reshape(-1, DISPARITIES)} | place
        bench.interrupt(items, clock=int(rng.integers(2, width*height)))
        out   = columns_of_raster(bench.run(items, width*height, valid)["costs"], width, height)
        for column in range(width):
            expected = sums[:, max(0, column - block_size + 1):column + 1].sum(axis=1)
            assert np.array_equal(out[:, column], expected), column


@pytest.mark.parametrize("disparities", [16, 48, 64])
@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_winner(disparities, valid):
    """Of equal costs the largest disparity wins; lanes out of use never do; only complete blocks come out."""
    rng   = generator(5, disparities)
    bench = Bench(Winner(MAX_WIDTH, disparities, MAX_BLOCK), ["disparities"])
    most  = MAX_BLOCK**2*255
    for used in range(16, disparities + 1, 16):
        # Few values make ties; the largest cost possible in all lanes in use is the hardest for the others to lose.
        costs       = rng.choice([0, 1, 2, most - 1, most], (500, disparities))
        costs[:100] = rng.integers(0, most + 1, (100, disparities))
        costs[100:110, :used] = most
        complete    = rng.integers(0, 2, len(costs))
        bench.set(disparities=used)
        items = {"costs": costs, "complete": complete}
        bench.interrupt(items, clock=int(rng.integers(2, len(costs))))
        out      = bench.run(items, int(complete.sum()), valid)
        chosen   = costs[complete == 1, :used]
        expected = used - 1 - chosen[:, ::-1].argmin(axis=1)
        assert np.array_equal(out["index"], expected)
        assert np.array_equal(out["cost"], chosen.min(axis=1))



@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_raster(valid):
    """Every pixel passes once, with its position, and none is admitted outside of a frame."""
    rng    = generator(6)
    module = Raster(MAX_WIDTH, 100, DISPARITIES, MAX_BLOCK)
    core   = StreamCore(module, ["width", "height", "disparities", "block_size", "begin", "credit"], pipeline=False)
    for block_size in (5, 9):
        for width, height, place in frames(rng, block_size):
            pixels = {name: rng.integers(0, 256, width*height + 5) for name in ("left", "right")}
            words  = pack(module.sink, pixels)
            core.set(width=width, height=height, disparities=DISPARITIES, block_size=block_size, credit=1)
            core.run(words[:0], 1, idle_clocks=4)
            core.set(begin=1)
            core.run(words[:0], 1, idle_clocks=1)
            core.set(begin=0)
            result = core.run(words, len(words), valid=valid, seed=SEED, idle_clocks=50)
            assert result.accepted == width*height
            out = unpack(module.source, result.words)
            for name, values in (pixels | place).items():
                assert np.array_equal(out[name], values[:width*height]), name
            core.reset()


@pytest.mark.parametrize("valid, ready", [(1.0, 1.0), (0.4, 1.0), (1.0, 0.4), (0.6, 0.6)])
def test_border(valid, ready):
    """The valid region's disparities lie in a frame of invalid pixels, under back-pressure on both sides."""
    rng    = generator(7)
    module = Border(MAX_WIDTH, 100, DISPARITIES, MAX_BLOCK)
    core   = StreamCore(module, ["width", "height", "disparities", "block_size", "begin"])
    for block_size in (5, 9):
        for width, height, place in frames(rng, block_size):
            count  = int(place["complete"].sum())
            values = rng.integers(0, 2**16, count)
            core.set(width=width, height=height, disparities=DISPARITIES, block_size=block_size)
            core.run(np.zeros(0, np.uint32), 1, idle_clocks=4)
            core.set(begin=1)
            core.run(np.zeros(0, np.uint32), 1, idle_clocks=1)
            core.set(begin=0)
            result = core.run(values.astype(np.uint32), width*height, valid=valid, ready=ready, seed=SEED)
            margin   = block_size//2
            expected = np.full((height, width), 2**16 - 16)
            expected[margin:height - margin, DISPARITIES - 1 + margin:width - margin] = values.reshape(
                height - 2*margin, -1)
            assert np.array_equal(result.words[:, 0], expected.ravel())
            assert result.first.nonzero()[0].tolist() == [0]
            assert result.last.nonzero()[0].tolist() == [width*height - 1]
            assert result.accepted == count
            core.reset()


@pytest.mark.parametrize("module, settings", [
    (LineBuffer(MAX_WIDTH, MAX_BLOCK), {"width": 30, "block_size": 5}),
    (AbsoluteDifference(MAX_WIDTH, DISPARITIES), {}),
    (ColumnSum(MAX_WIDTH, DISPARITIES, MAX_BLOCK), {}),
    (BlockSum(MAX_WIDTH, DISPARITIES, MAX_BLOCK), {"block_size": 5}),
    (Winner(MAX_WIDTH, 48, MAX_BLOCK), {"disparities": 48}),
], ids=lambda value: type(value).__name__)
def test_latency(module, settings):
    """An item comes out as many clocks after it went in as the core says."""
    core = StreamCore(module, list(settings), pipeline=True)
    core.set(**settings)
    result = core.run(pack(module.sink, {"complete": np.ones(1)}), 1)
    assert result.probe_clock - 1 == module.latency
