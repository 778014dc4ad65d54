#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The cores of the rectifier, one by one: emitted Verilog against NumPy and OpenCV."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.rectification.bilinear import Bilinear
from litestereo.gateware.rectification.map_grid import MapGrid
from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.remap import Remap
from litestereo.gateware.rectification.row_window import RowWindow
from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.sim.models import rectification as model
from support.core_bench import CoreBench
from support.lanes import unpack
from support.pairs import generator
from support.rectification_maps import as_grid, drawn_grids, noise, opencv_remap
from support.rectifier_bench import load_words

SMALL = RectifierParameters(max_width=49, max_height=40, rows=8)


# Bilinear ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_bilinear(valid):
    """All 1024 fractions, with all extreme and with drawn pixels, give what cv2.remap gives."""
    rng     = generator(300)
    corners = np.stack(np.meshgrid(*[[0, 255]]*4), axis=-1).reshape(-1, 4)
    pixels  = np.concatenate([corners, rng.integers(0, 256, (8, 4))])
    # An image with a block of 2 x 2 pixels per item, and the position in it.
    tiles   = np.tile(pixels, (1024, 1))
    a, b    = (np.repeat(np.arange(1024) >> shift & 31, len(pixels)) for shift in (0, 5))
    bench   = CoreBench(Bilinear())
    fields  = dict(zip(("p00", "p01", "p10", "p11"), tiles.T, strict=True))
    fields |= {"column_fraction": a, "row_fraction": b}
    bench.interrupt(fields, clock=100)
    out      = bench.run(fields, len(tiles), valid)["pixel"]
    expected = model.blend(*tiles.T, a, b)
    assert np.array_equal(out, expected)
    # OpenCV has 16 bits for a column.
    for part in np.array_split(np.arange(len(tiles)), 4):
        image   = tiles[part].reshape(-1, 2, 2).transpose(1, 0, 2).reshape(2, -1).astype(np.uint8)
        column  = 64*np.arange(len(part))
        mapped  = opencv_remap(image, ((column + a[part])[None].astype(np.int32), b[part][None].astype(np.int32)))
        assert np.array_equal(mapped[0], expected[part])


def test_latency_of_bilinear():
    """An item comes out as many clocks after its entry as the core declares."""
    bench  = CoreBench(Bilinear())
    result = bench.core.run(np.zeros((1, bench.core.sink_words), np.uint32), 1)
    assert result.probe_clock - 1 == bench.module.latency


# Map --------------------------------------------------------------------------------------------------


class MapBench:
    """The map of both cameras in Verilator."""

    def __init__(self, parameters):
        self.module = MapGrid(parameters)
        self.core   = StreamCore(self.module, ["width", "height", "begin", "grid", "reserved"],
                                 status=["busy", "refused"])

    def idle(self, clocks):
        self.core.run(np.zeros((0, self.core.sink_words), np.uint32), 1, ready=0, idle_clocks=clocks)

    def load(self, number, grids):
        """Write the grids of both cameras."""
        words = load_words(self.module.sink, number, grids)
        assert self.core.run(words, 1, ready=0, idle_clocks=2).accepted == len(words)

    def begin(self, width, height, number):
        self.core.set(width=width, height=height, grid=number)
        self.idle(4)
        self.core.set(begin=1)
        self.idle(1)
        self.core.set(begin=0)

    def positions(self, width, height, ready=1.0):
        """Return u and v of both cameras, and whether the map folds over."""
        result = self.core.run(np.zeros((0, self.core.sink_words), np.uint32), width*height + 1, ready=ready,
                               idle_clocks=200)
        assert len(result.words) == width*height
        assert result.first.nonzero()[0].tolist() == [0] and result.last.nonzero()[0].tolist() == [width*height - 1]
        assert not self.core.get("busy")
        self.clocks = result.clocks
        out  = {name: values.astype(np.int64).reshape(height, width)
                for name, values in unpack(self.module.source, result.words).items()}
        bits = self.module.parameters.position_bits

        def axis(name):
            whole = (out[name] ^ 1 << bits - 1) - (1 << bits - 1)
            return 32*whole + out[f"{name}_fraction"]

        return [(axis(f"{camera}_column"), axis(f"{camera}_row")) for camera in ("left", "right")], out["folded"]

    def check(self, width, height, grids, ready=1.0):
        """Compare the positions of a frame with the model."""
        maps, folded = self.positions(width, height, ready)
        for got, grid in zip(maps, grids, strict=True):
            expected = model.expand(grid, width, height)
            assert np.array_equal(got[0], expected[0]) and np.array_equal(got[1], expected[1])
        assert np.array_equal(folded != 0, np.any([model.folded(grid, width, height) for grid in grids], axis=0))


@pytest.fixture(scope="module")
def map_bench():
    """Return the small map in Verilator."""
    return MapBench(SMALL)


@pytest.mark.parametrize("ready", [1.0, 0.4])
def test_map_grid(map_bench, ready):
    """Drawn and extreme nodes, all sizes, both grids and a reset in mid-frame give the model's positions and folds."""
    rng = generator(301)
    for number, (width, height) in enumerate([(49, 40), (48, 33), (33, 17), (32, 16), (24, 9), (17, 5), (9, 3)]):
        ends  = rng.choice([-2**15, -1, 0, 2**15 - 1], (*model.grid_shape(width, height), 2)).astype(np.int16)
        grids = (noise(width, height, rng, 250, 250), ends) if number % 2 else drawn_grids(width, height, rng)
        map_bench.load(number % 2, grids)
        map_bench.load(1 - number % 2, [noise(width, height, rng) for _ in range(2)])
        map_bench.begin(width, height, number % 2)
        if number % 3 == 2:
            map_bench.core.run(np.zeros((0, map_bench.core.sink_words), np.uint32), width*height, ready=0.7,
                               reset_clock=int(rng.integers(2, width*height)))
            map_bench.core.reset()
            map_bench.begin(width, height, number % 2)
        map_bench.check(width, height, grids, ready)
        # The first position waits for two nodes, all others leave one per clock.
        if ready == 1 and width >= 24:
            assert map_bench.clocks <= width*height + 24


def test_folds(map_bench):
    """A position that stays where the one before is, is a fold; one 128th of a pixel to the right is none."""
    rows, columns = model.grid_shape(48, 32)
    level         = np.zeros((rows, columns))
    across, down  = -16*np.arange(columns)[None] + level, -16*np.arange(rows)[:, None] + level
    for slack, folds in [(0, True), (1/128, False)]:
        for x, y in [(across + slack*np.arange(columns)[None], level), (level, down + slack*np.arange(rows)[:, None])]:
            grids = [as_grid(level, level), as_grid(x, y)]
            assert all(model.folded(grids[1], 48, 32).ravel() == folds)
            map_bench.load(0, grids)
            map_bench.begin(48, 32, 0)
            map_bench.check(48, 32, grids)


def test_nodes_of_the_grid_in_use(map_bench):
    """They are dropped and reported, from the reservation to the frame's end; the other grid is written meanwhile."""
    rng   = generator(302)
    first, second, third = [[noise(33, 20, rng), noise(33, 20, rng)] for _ in range(3)]
    sink  = map_bench.module.sink
    word  = load_words(sink, 0, third)[:1]
    map_bench.load(0, first)
    map_bench.core.set(grid=0, reserved=1)
    map_bench.load(0, third)
    map_bench.core.set(reserved=0)
    map_bench.begin(33, 20, 0)
    map_bench.load(0, third)
    map_bench.load(1, second)
    map_bench.check(33, 20, first)
    map_bench.begin(33, 20, 1)
    map_bench.load(0, third)
    map_bench.check(33, 20, second)
    map_bench.begin(33, 20, 0)
    map_bench.check(33, 20, third)
    assert map_bench.core.run(word, 1, ready=0, idle_clocks=1).accepted == 1


# Ring -------------------------------------------------------------------------------------------------


def pins_of(endpoint, prefix):
    """Return the Signals of a pipeline's endpoint by name."""
    return {f"{prefix}_valid": endpoint.valid} | {
        f"{prefix}_{name}": getattr(endpoint, name) for name, *_ in endpoint.description.payload_layout}


@pytest.mark.parametrize("width", [49, 24])
def test_remap(width):
    """2 x 2 pixels anywhere in a ring of odd and even columns are blended while the next row comes in."""
    rng     = generator(303, width)
    module  = Remap(SMALL)
    core    = PinCore(module, pins_of(module.write, "write") | pins_of(module.sink, "sink"),
                      pins_of(module.source, "source"))
    tracks  = SMALL.rows
    ring    = np.zeros((tracks, width), np.uint8)
    pending = []
    for clock in range(tracks*width + 2500):
        track, column = clock//width % tracks, clock % width
        reads = {}
        if clock >= tracks*width:
            # Neither the row under way nor, with its lower neighbour, the one above.
            row   = (track + int(rng.integers(1, tracks - 1))) % tracks
            x     = int(rng.integers(-1, width))
            rows  = int(rng.integers(4))
            sides = (x >= 0) | (x + 1 < width) << 1
            a, b  = (int(rng.integers(32)) for _ in range(2))
            four  = [ring[(row + dy) % tracks, x + dx] if rows >> dy & 1 and sides >> dx & 1 else 0
                     for dy in (0, 1) for dx in (0, 1)]
            pending.append(int(model.blend(*four, a, b)))
            reads = {"sink_track": row, "sink_column": x & (1 << SMALL.position_bits) - 1, "sink_rows_inside": rows,
                     "sink_columns_inside": int(sides), "sink_column_fraction": a, "sink_row_fraction": b}
        pixel = int(rng.integers(256))
        core.set(write_valid=1, write_track=track, write_column=column, write_pixel=pixel, sink_valid=bool(reads),
                 **reads)
        assert core.get("source_valid") == (clock >= tracks*width + module.latency)
        if core.get("source_valid"):
            assert core.get("source_pixel") == pending.pop(0)
        ring[track, column] = pixel
        core.clock()
    core.close()


# Window -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width, height, lead, flow", [
    (6, 11, 1, (1.0, 1.0, 1.0)), (7, 8, 0, (0.5, 1.0, 0.6)), (5, 20, 3, (1.0, 0.3, 1.0)), (4, 6, 7, (1.0, 1.0, 0.3)),
])
def test_row_window(width, height, lead, flow):
    """A position leaves when its rows are complete, with their track; it is gone when they are not there."""
    rng    = generator(304, width)
    module = RowWindow(SMALL)
    raw, sink = module.raw, module.sink
    inputs = {name: getattr(module, name) for name in ("width", "height", "lead", "begin", "credit")}
    inputs |= pins_of(raw, "raw") | pins_of(sink, "sink") | {"sink_first": sink.first, "sink_last": sink.last}
    core   = PinCore(module, inputs, pins_of(module.write, "write") | pins_of(module.source, "source") | {
        "raw_ready": raw.ready, "sink_ready": sink.ready, "writing": module.writing})
    core.set(width=width, height=height, lead=lead)
    for _ in range(3):
        core.clock()
    frames = 4
    place  = np.arange(width*height)
    rows   = np.stack([np.clip(place//width + rng.integers(-3, 4, (2, width*height)), -2, height)
                       for _ in range(frames)])
    columns = np.stack([np.clip(place % width + rng.integers(-2, 3, (2, width*height)), -2, width)
                        for _ in range(frames)])
    offered, taken, begun, accepted, left = [False, False], 0, 0, 0, 0
    tracks, gone = {}, 0                        # Which row of which frame each track has, complete rows only.
    mask = (1 << SMALL.position_bits) - 1
    for _ in range(frames*width*height*8):
        begin = begun < frames and not core.get("writing") and begun*width*height == accepted and rng.random() < 0.5
        if not offered[0] and accepted < begun*width*height:
            offered[0] = rng.random() < flow[0]
        if not offered[1] and taken < frames*width*height:
            offered[1] = rng.random() < flow[1]
        pins = {"raw_valid": offered[0], "raw_left": accepted & 255, "raw_right": accepted >> 8 & 255}
        if taken < frames*width*height:
            frame, index = divmod(taken, width*height)
            pins |= {f"sink_{camera}_{axis}": int(values[frame, side, index]) & mask
                     for side, camera in enumerate(("left", "right"))
                     for axis, values in (("row", rows), ("column", columns))}
            pins |= {"sink_first": index == 0, "sink_last": index == width*height - 1}
        core.set(sink_valid=offered[1], begin=begin, credit=rng.random() < flow[2], **pins)
        begun += begin
        # What leaves in this clock is read before what is written in it.
        if core.get("source_valid"):
            frame, index = divmod(left, width*height)
            lost = False
            for side, camera in enumerate(("left", "right")):
                row, column = rows[frame, side, index], columns[frame, side, index]
                used   = -1 <= row < height and -1 <= column < width
                wanted = [y for y in (row, row + 1) if 0 <= y < height] if used else []
                track  = core.get(f"source_{camera}_track")
                there  = all(tracks.get((track + y - row) % SMALL.rows) == (frame, y) for y in wanted)
                marks  = core.get(f"source_{camera}_rows_inside")
                if wanted and not marks:
                    lost = True
                    assert not there
                else:
                    assert there and marks == sum(1 << y - row for y in wanted)
            assert core.get("source_row_gone") == lost
            gone += lost
            left += 1
        if core.get("write_valid"):
            number, column = divmod(core.get("write_left") | core.get("write_right") << 8, width)
            assert core.get("write_column") == column and core.get("write_track") == number % SMALL.rows
            # From then on the next track is that of the row under way.
            if column == width - 1:
                tracks[number % SMALL.rows] = divmod(number, height)
                tracks[(number + 1) % SMALL.rows] = None
        if offered[0] and core.get("raw_ready"):
            accepted, offered[0] = accepted + 1, False
        if offered[1] and core.get("sink_ready"):
            taken, offered[1] = taken + 1, False
        core.clock()
    assert (left, accepted) == (frames*width*height, frames*width*height)
    needs = max(model.rows_needed([(32*columns[frame, side].reshape(height, width),
                                    32*rows[frame, side].reshape(height, width)) for side in range(2)], lead)
                for frame in range(frames))
    assert needs > SMALL.rows or not gone
    core.close()


# Parameters -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("parameters, message", [
    ({"max_width": 16},   "max_width"),
    ({"max_width": 5000}, "max_width"),
    ({"max_height": 1},   "max_height"),
    ({"max_height": 4096}, "max_height"),
    ({"rows": 63},        "rows must be even"),
    ({"rows": 2},         "rows must be even"),
    ({"rows": 514},       "rows must be even"),
])
def test_bad_parameters(parameters, message):
    """Bad parameters are refused by name."""
    with pytest.raises(ValueError, match=message):
        RectifierParameters(**parameters)
