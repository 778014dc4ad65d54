#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames that the peripheral rectifies, stored and streamed: map, images and flags against the models and OpenCV."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.common.parameters import FEATURES, MatcherParameters
from litestereo.gateware.peripherals.rectification import LEAD
from litestereo.gateware.peripherals.stereo_peripheral import (
    ERROR_ABORTED,
    ERROR_BUS,
    ERROR_CONFIG,
    ERROR_NONE,
    StereoPeripheral,
)
from litestereo.sim.models import rectification as model
from litestereo.sim.models.stereo_bm import stereo_bm
from support.pairs import byte_generator, textured_pair
from support.peripheral_bench import MAX_RECTIFIED, MAX_WIDTH, PORTS, ROWS, Bench, break_off, registers
from support.rectification_maps import as_grid, drawn_grids, maps_of, opencv_remap, shifted

FEATURES_BUILT = (*FEATURES, "rectification")
KINDS          = ["wishbone-32", "native-64", "wishbone-32 crossed"]
SIZES          = [(33, 11, 5), (MAX_WIDTH, 17, 9), (20, 5, 5), (37, MAX_RECTIFIED, 7), (24, 9, 9)]
OUTS           = [(0, 0), (1, 0), (0, 1), (1, 1)]

LEFT_OUT, RIGHT_OUT = 1 << 14, 3 << 13  # Where the images go.


class Frame:
    """A frame, and what must come of it."""
    def __init__(self, bench, width, height, block_size, grids, outs, streamed):
        seed          = np.random.default_rng(bench.rng.getrandbits(32))
        self.settings = bench.draw(width, block_size)
        self.raw      = textured_pair(width, height, seed, 5)
        self.outs     = outs
        self.streamed = streamed
        self.pair     = self.raw
        self.folded   = 0
        if grids:
            self.folded = int(any(model.folded(grid, width, height).any() for grid in grids))
            maps      = maps_of(grids, width, height)
            self.pair = tuple(model.remap(*one) for one in zip(self.raw, maps, strict=True))
            assert all(np.array_equal(opencv_remap(raw, one), image)
                       for raw, one, image in zip(self.raw, maps, self.pair, strict=True))
        self.map      = stereo_bm(*self.pair, self.settings)


class RectifiedBench(Bench):
    """The peripheral, its grids, and frames that are rectified or not."""
    def __init__(self, kind, rng):
        super().__init__(kind, rng, FEATURES_BUILT)
        for _ in range(200 if self.crossed else 0):
            self.clock() # After a reset both sides of a crossing first agree on that.

    def load(self, number, grids):
        """Load a grid, a node per clock, or slower to a separate clock; return how many nodes were dropped."""
        dropped = 0
        for camera, grid in enumerate(grids):
            for node, (column, row) in enumerate(grid.reshape(-1, 2).astype(int).tolist()):
                self.core.set(load_valid=1, load_camera=camera, load_grid=number, load_node=node,
                              load_column=column & 0xffff, load_row=row & 0xffff)
                dropped += self.core.get("dropped")
                self.clock()
                self.core.set(load_valid=0)
                for _ in range(5 if self.crossed else 0):
                    self.clock()
        return dropped

    def drawn_grids(self, width, height):
        """Draw grids that the rings have rows for."""
        rng = np.random.default_rng(self.rng.getrandbits(32))
        while True:
            grids = drawn_grids(width, height, rng)
            if model.rows_needed(maps_of(grids, width, height), LEAD) <= ROWS:
                return grids

    def begin_frame(self, width, height, block_size, grids=None, number=0, outs=(0, 0), streamed=False, changes=None):
        """Start a frame, which has `grids` if they are given."""
        frame = Frame(self, width, height, block_size, grids, outs, streamed)
        step  = self.dut.alignment
        self.places = (128*step, 128*step + 4096, 128*step + 8192)
        if not streamed:
            for base, image in zip(self.places, frame.raw, strict=False):
                self.memory.bytes[base:base + image.size] = image.tobytes()
        self.memory.reads.clear()
        self.core.set(left_base=self.places[0], right_base=self.places[1], disparity_base=self.places[2],
                      left_out_base=LEFT_OUT, right_out_base=RIGHT_OUT, left_out=outs[0], right_out=outs[1],
                      rectified=int(grids is not None), grid=number, streamed=int(streamed), grid_width=width,
                      grid_height=height, **registers(width, height, frame.settings))
        self.core.set(**(changes or {}))
        self.before = bytes(self.memory.bytes)
        self.pulse("start")
        return frame

    def finish(self, frame, chance=1.0):
        """Run to the end of a frame; return the last event."""
        return self.stream(frame.raw, chance)[0] if frame.streamed else self.end()

    def check(self, frame):
        """Check what the frame left behind: map, images and flags are right, and nothing else was written."""
        assert self.core.get("error_code") == ERROR_NONE
        assert (self.core.get("row_gone"), self.core.get("folded")) == (0, frame.folded)
        assert frame.streamed <= (self.memory.reads == [])
        step    = self.dut.alignment
        changed = bytearray(self.before)
        wanted  = [(self.places[2], frame.map)] + [(base, image) for base, image, out in
                   zip((LEFT_OUT, RIGHT_OUT), frame.pair, frame.outs, strict=True) if out]
        for base, data in wanted:
            assert bytes(self.memory.bytes[base:base + data.nbytes]) == data.tobytes()
            end = base + -(-data.nbytes//step)*step
            changed[base:end] = self.memory.bytes[base:end]
        assert self.memory.bytes == changed

    def check_drawn(self, size, number=0, streamed=False, outs=(0, 0), chance=1.0):
        """Check a whole frame with drawn grids."""
        grids = self.drawn_grids(*size[:2])
        assert self.load(number, grids) == 0
        frame = self.begin_frame(*size, grids, number, outs, streamed)
        assert self.finish(frame, chance) == ["done"]
        self.check(frame)


@pytest.fixture(scope="module", params=KINDS)
def bench(request):
    bench = RectifiedBench(request.param, byte_generator(40, request.param))
    yield bench
    bench.core.close()


def test_frames(bench):
    """Stored and streamed frames, rectified and raw ones, of all sizes, with any images: maps and images are right."""
    for number, size in enumerate(SIZES):
        for streamed in (False, True):
            bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
            bench.check_drawn(size, number % 2, streamed, OUTS[(number + streamed) % 4],
                              bench.rng.choice([1.0, 0.7, 0.2]))
            raw = bench.begin_frame(*SIZES[number - 1], outs=OUTS[(number + 2 + streamed) % 4], streamed=not streamed)
            assert bench.finish(raw) == ["done"]
            bench.check(raw)


def test_high_frames_pass(bench):
    """A raw frame may be higher than one that can be rectified."""
    frame = bench.begin_frame(20, 70, 5, outs=(1, 0))
    assert bench.finish(frame) == ["done"]
    bench.check(frame)
    bench.check_drawn(SIZES[0])


def test_two_grids(bench):
    """The grid that is not in use may be loaded during a frame; nodes for the other one are dropped until its end."""
    size          = (33, 17, 5)
    first, second = bench.drawn_grids(*size[:2]), bench.drawn_grids(*size[:2])
    bench.memory.speed = 0.3
    assert bench.load(0, first) == 0
    frame  = bench.begin_frame(*size, first, 0, (1, 1))
    assert bench.load(1, second) == 0
    assert bench.load(0, second) == sum(grid.size//2 for grid in second)
    assert bench.core.get("busy"), "the frame was too short for this test"
    assert bench.end() == ["done"]
    bench.check(frame)
    frame = bench.begin_frame(*size, second, 1, (1, 1))
    assert bench.end() == ["done"]
    bench.check(frame)
    assert bench.load(1, first) == 0


@pytest.mark.parametrize("changes", [
    {"grid_width": 34}, {"grid_width": 0, "grid_height": 0}, {"grid_height": 12}, {"left_out_base": LEFT_OUT + 2},
    {"right_out_base": RIGHT_OUT + 1},
    {"height": MAX_RECTIFIED + 1, "grid_height": MAX_RECTIFIED + 1}], ids=str)
def test_refused(bench, changes):
    """A frame of another size than its grid's, without a grid, too high, or with bad addresses never begins."""
    grids = bench.drawn_grids(33, 11)
    bench.load(0, grids)
    bench.begin_frame(33, 11, 5, grids, changes=changes)
    assert bench.end(100) == ["failed"]
    assert bench.core.get("error_code") == ERROR_CONFIG
    assert not bench.memory.reads and bytes(bench.memory.bytes) == bench.before
    bench.check_drawn((33, 11, 5))


def test_flags(bench):
    """A row that is gone, and a map that folds over, are told with the frame, and not with the next one."""
    level    = shifted(40, 36, 0, 0)
    mirrored = as_grid(39 - 2*model.STEP*np.arange(4)[None] + np.zeros((4, 1)), np.zeros((4, 4)))
    bench.memory.speed = 1.0
    for streamed in (False, True):
        for grids, gone, folded in [((level, shifted(40, 36, 0, 30)), 1, 0), ((mirrored, mirrored), 0, 1)]:
            assert bench.load(0, grids) == 0
            frame = bench.begin_frame(40, 36, 5, grids, streamed=streamed)
            assert bench.finish(frame) == ["done"]
            assert (bench.core.get("row_gone"), bench.core.get("folded")) == (gone, folded)
            raw   = bench.begin_frame(30, 8, 5)
            assert bench.finish(raw) == ["done"]
            bench.check(raw)


def test_rows_after_the_last_position(bench):
    """Rows that no pixel needs come in before the frame ends, stored or streamed, and pairs of the next frame wait."""
    up = shifted(33, 24, 0, -9)
    bench.memory.speed = 1.0
    for streamed in (False, True):
        assert bench.load(1, (up, up)) == 0
        frame = bench.begin_frame(33, 24, 5, (up, up), 1, (0, 1), streamed)
        assert bench.finish(frame, 0.3) == ["done"]
        bench.check(frame)
        bench.core.set(pairs_valid=1)
        for _ in range(20):
            assert not bench.core.get("pairs_ready")
            bench.clock()
        bench.core.set(pairs_valid=0)


def test_abort(bench):
    """A frame aborted at any clock ends soon, and the next one is right."""
    for number in range(16):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        streamed = number % 2 == 1
        grids    = bench.drawn_grids(33, 11)
        bench.load(0, grids)
        frame    = bench.begin_frame(33, 11, 5, grids, outs=OUTS[number % 4], streamed=streamed)
        clocks   = bench.rng.choice([number, bench.rng.randrange(60), bench.rng.randrange(900)])
        if streamed:
            events = break_off(bench, frame.raw, clocks, bench.abort)
        else:
            events = [event for _ in range(clocks) for event in bench.clock()]
            events = events or bench.pulse("abort") or bench.end(2000)
        assert events == ["done"] or bench.core.get("error_code") == ERROR_ABORTED
        bench.check_drawn(SIZES[number % len(SIZES)], 1, number % 3 == 1, OUTS[number//4])


def test_bus_error(bench):
    """An error on any access, also that of an image, ends the frame with its code, and the next one is right."""
    if not bench.errs:
        pytest.skip("this port has no errors")
    grids = bench.drawn_grids(33, 11)
    for _ in range(10):
        bench.load(0, grids)
        bench.begin_frame(33, 11, 5, grids, outs=(1, 1))
        bench.memory.fail_after = bench.rng.randrange(400)
        events = bench.end(8000)
        bench.memory.fail_after = None
        assert events == ["done"] or bench.core.get("error_code") == ERROR_BUS
        bench.check_drawn((33, 11, 5), outs=(1, 1))


def test_reset_in_mid_frame(bench):
    """After a reset at any clock the next frame is right; the grids are still there."""
    grids = bench.drawn_grids(33, 11)
    bench.load(1, grids)
    for number in range(8):
        bench.memory.speed = bench.rng.choice([1.0, 0.4])
        bench.begin_frame(33, 11, 5, grids, 1, OUTS[number % 4])
        for _ in range(bench.rng.randrange(900)):
            bench.clock()
        bench.reset()
        assert not bench.core.get("busy")
        frame = bench.begin_frame(33, 11, 5, grids, 1, (1, 0))
        assert bench.end() == ["done"]
        bench.check(frame)


@pytest.mark.parametrize("kind", ["wishbone-32", "native-64"])
def test_bypass_costs_no_clock(kind):
    """A raw frame takes as many clocks as in a peripheral without rectification."""
    clocks = []
    for features in (FEATURES, FEATURES_BUILT):
        bench = Bench(kind, byte_generator(41), features)
        bench.check_frame(MAX_WIDTH, 30)
        clocks.append((bench.core.get("clocks"), bench.core.get("first_row_clocks")))
        bench.core.close()
    assert clocks[0] == clocks[1]


@pytest.mark.parametrize("features, ports", [(FEATURES, 2), (FEATURES_BUILT, 0), (FEATURES_BUILT, 1)])
def test_image_ports(features, ports):
    """The rectification has two image ports, and without it there are none."""
    parameters = MatcherParameters(MAX_WIDTH, disparities=16, max_block_size=9, features=features)
    make       = PORTS["wishbone-32"]
    with pytest.raises(ValueError, match=f"two image ports, and without it none, not {ports}"):
        StereoPeripheral(*make(), parameters, image_ports=tuple(make()[1] for _ in range(ports)))


def test_rows_that_cannot_be_built():
    """Rows of the rings that are no even number are refused when the peripheral is built."""
    parameters = MatcherParameters(MAX_WIDTH, disparities=16, max_block_size=9, features=FEATURES_BUILT,
                                   rectification_rows=7)
    make       = PORTS["wishbone-32"]
    with pytest.raises(ValueError, match="rows must be even and from 4 to 512, not 7"):
        StereoPeripheral(*make(), parameters, image_ports=(make()[1], make()[1]))
