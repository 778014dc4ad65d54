#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher between memory and memory, on each kind of port: slow memory, aborts, errors, bad settings, resets."""

from __future__ import annotations

import numpy as np
import pytest
from litedram.common import LiteDRAMNativePort
from litex.soc.interconnect import wishbone

from litestereo.gateware.peripheral import (
    ERROR_ABORTED,
    ERROR_BUS,
    ERROR_CONFIG,
    ERROR_NONE,
    StereoPeripheral,
)
from litestereo.sim.model import match
from litestereo.sim.pin_core import PinCore
from support.memory import Memory, port_pins, slave
from support.pairs import byte_generator, textured_pair

MAX_WIDTH, DISPARITIES, MAX_BLOCK = 48, 16, 9
MEMORY_BYTES = 1 << 15
SETTINGS     = ("left_base", "right_base", "disparity_base", "width", "height", "disparities", "block_size")


def wishbone_port(width):
    return wishbone.Interface(data_width=width, address_width=32, addressing="word")


def native_port(width, mode):
    return LiteDRAMNativePort(mode=mode, address_width=24, data_width=width)


PORTS = {
    "wishbone-32":  lambda: (wishbone_port(32), wishbone_port(32)),
    "wishbone-128": lambda: (wishbone_port(128), wishbone_port(128)),
    "native-32":    lambda: (native_port(32, "read"), native_port(32, "write")),
    "native-64":    lambda: (native_port(64, "read"), native_port(64, "write")),
}


class Bench:
    """The peripheral with memory behind its ports, and a frame's life seen from its registers."""
    def __init__(self, kind, rng):
        ports    = dict(zip(("read", "write"), PORTS[kind](), strict=True))
        self.dut = dut = StereoPeripheral(ports["read"], ports["write"], MAX_WIDTH, DISPARITIES, MAX_BLOCK,
                                          burst_bytes=64, with_csr=False)
        inputs   = {name: getattr(dut, name) for name in (*SETTINGS, "start", "abort")}
        outputs  = {name: getattr(dut, name)
                    for name in ("busy", "done", "failed", "error_code", "clocks", "first_row_clocks", "frames")}
        for name, port in ports.items():
            more_inputs, more_outputs = port_pins(name, port)
            inputs  |= more_inputs
            outputs |= more_outputs
        self.rng    = rng
        self.core   = PinCore(dut, inputs, outputs)
        self.memory = Memory(MEMORY_BYTES, dut.alignment, rng)
        self.slaves = [slave(self.core, name, port, self.memory) for name, port in ports.items()]
        self.clocks = 0

    def clock(self):
        for one in self.slaves:
            one.step()
        events = [name for name in ("done", "failed") if self.core.get(name)]
        self.core.clock()
        self.clocks += 1
        return events

    def begin(self, width, height, block_size=5, changes=None):
        """Lay out a pair in memory and start; returns the expected map and where it goes."""
        pixels = width*height
        step   = self.dut.alignment
        places = [128*step, 128*step + 4096, 128*step + 8192 + step*self.rng.randrange(8)]
        pair   = textured_pair(width, height, np.random.default_rng(self.rng.getrandbits(32)), 5)
        for base, image in zip(places, pair, strict=False):
            self.memory.bytes[base:base + pixels] = image.tobytes()
        self.memory.reads.clear()
        self.memory.writes.clear()
        settings = dict(zip(SETTINGS, (*places, width, height, DISPARITIES, block_size), strict=True)) | (changes or {})
        self.core.set(**settings)
        self.pulse("start")
        return match(*pair, DISPARITIES, block_size) if not changes else None, places

    def pulse(self, name):
        self.core.set(**{name: 1})
        events = self.clock()
        self.core.set(**{name: 0})
        return events

    def end(self, limit=60000):
        """Run until the frame ends; returns the event."""
        for _ in range(limit):
            if events := self.clock():
                assert not self.core.get("busy")
                return events
        raise AssertionError(f"no end after {limit} clocks")

    def map_at(self, base, shape):
        size = 2*shape[0]*shape[1]
        return np.frombuffer(bytes(self.memory.bytes[base:base + size]), "<i2").reshape(shape)

    def check_frame(self, width, height, block_size=5):
        """A whole frame: right, complete, and not a byte outside of its map and the padding of its last word."""
        expected, places = self.begin(width, height, block_size)
        before = bytes(self.memory.bytes)
        assert self.end() == ["done"]
        self.check_result(expected, places, before)

    def check_result(self, expected, places, before):
        assert self.core.get("error_code") == ERROR_NONE
        base, size, step = places[2], expected.size*2, self.dut.alignment
        assert np.array_equal(self.map_at(base, expected.shape), expected)
        end = base + -(-size//step)*step
        assert bytes(self.memory.bytes[:base]) == before[:base]
        assert bytes(self.memory.bytes[end:]) == before[end:]
        words = range(base, end, step)
        assert self.memory.writes == list(words), "each word of the map is written once, in order"
        images = sorted(start + offset for start in places[:2] for offset in range(0, expected.size, step))
        assert sorted(self.memory.reads) == images, "each word of the images is read once"


@pytest.fixture(params=PORTS)
def bench(request):
    rng   = byte_generator(20, request.param)
    bench = Bench(request.param, rng)
    yield bench
    bench.core.close()


SIZES = [(20, 5, 5), (21, 5, 5), (MAX_WIDTH, 9, 9), (MAX_WIDTH, 13, 7), (37, 11, 5), (24, 9, 9)]


def test_sizes(bench):
    """Smallest legal image, odd sizes, width = maximum, whatever the memory's speed."""
    for speed in (1.0, 0.6, 0.15):
        bench.memory.speed = speed
        for size in SIZES:
            bench.check_frame(*size)
    assert bench.core.get("frames") == 3*len(SIZES)


def test_counts_clocks(bench):
    """`clocks` is the number of clocks between start and done, and the first row comes before."""
    bench.begin(MAX_WIDTH, 9)
    start = bench.clocks
    assert bench.end() == ["done"]
    assert abs(bench.core.get("clocks") - (bench.clocks - start)) <= 1
    assert 5*MAX_WIDTH < bench.core.get("first_row_clocks") < bench.core.get("clocks")


def test_abort_and_restart(bench):
    """A frame given up at any clock ends soon, and the next one is right."""
    for turn in range(25):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        bench.begin(33, 11)
        events = [event for _ in range(bench.rng.randrange(1000)) for event in bench.clock()]
        if not events:
            events = bench.pulse("abort")
        if not events:
            events = bench.end(2000)
        if events == ["failed"]:
            assert bench.core.get("error_code") == ERROR_ABORTED
        else:
            assert events == ["done"]
        bench.check_frame(*SIZES[turn % len(SIZES)])


def test_abort_at_once(bench):
    """An abort counts from the first clock of a frame, before memory is asked for anything."""
    for wait in range(10):
        bench.begin(33, 11)
        events = [event for _ in range(wait) for event in bench.clock()]
        assert (events + bench.pulse("abort") or bench.end(500)) == ["failed"]
        assert bench.core.get("error_code") == ERROR_ABORTED
        bench.check_frame(33, 11)


def test_abort_while_idle(bench):
    """Nothing to give up: nothing happens."""
    assert bench.pulse("abort") == []
    assert not any(bench.clock() for _ in range(50))
    bench.check_frame(30, 8)


def test_start_while_busy(bench):
    """It is ignored."""
    expected, places = bench.begin(30, 8)
    before = bytes(bench.memory.bytes)
    for _ in range(60):
        assert bench.pulse("start") == []
    assert bench.end() == ["done"]
    bench.check_result(expected, places, before)
    assert not any(bench.clock() for _ in range(200))


def test_settings_of_the_next_frame(bench):
    """What is written during a frame takes effect on the next one and never within one."""
    for turn in range(12):
        expected, places = bench.begin(33, 11, 7)
        before = bytes(bench.memory.bytes)
        events = [event for _ in range(bench.rng.randrange(300)) for event in bench.clock()]
        bench.core.set(left_base=0, right_base=0, disparity_base=0, width=20 + turn, height=6, block_size=5)
        assert (events or bench.end()) == ["done"]
        bench.check_result(expected, places, before)


@pytest.mark.parametrize("changes", [
    {"width": 0}, {"width": 19}, {"width": MAX_WIDTH + 1}, {"width": 0xffff}, {"height": 0}, {"height": 4},
    {"height": 4096}, {"disparities": 0}, {"disparities": 8}, {"disparities": 32}, {"block_size": 0}, {"block_size": 3},
    {"block_size": 4}, {"block_size": 6}, {"block_size": 11}, {"left_base": 2}, {"right_base": 129},
    {"disparity_base": 1},
], ids=str)
def test_bad_settings(changes):
    """They are refused before memory is touched, and the next frame is right."""
    bench = Bench("wishbone-32", byte_generator(21, str(changes)))
    bench.begin(30, 8, changes=changes)
    assert bench.end(100) == ["failed"]
    assert bench.core.get("error_code") == ERROR_CONFIG
    assert not bench.memory.reads and not bench.memory.writes
    bench.check_frame(30, 8)
    bench.core.close()


@pytest.mark.parametrize("kind", ["wishbone-32", "wishbone-128"])
def test_bus_error(kind):
    """An error on any access ends the frame with its code, and the next one is right."""
    bench = Bench(kind, byte_generator(22, kind))
    for _ in range(20):
        bench.begin(33, 11)
        bench.memory.fail_after = bench.rng.randrange(60)
        assert bench.end(4000) == ["failed"]
        assert bench.core.get("error_code") == ERROR_BUS
        bench.memory.fail_after = None
        bench.check_frame(33, 11)
    bench.core.close()


def test_reset_in_mid_frame(bench):
    """After a reset of the whole core at any clock the next frame is right."""
    for turn in range(15):
        bench.memory.speed = bench.rng.choice([1.0, 0.4])
        bench.begin(33, 11)
        for _ in range(bench.rng.randrange(900)):
            bench.clock()
        bench.core.reset()
        for one in bench.slaves:
            one.reset()
        assert not bench.core.get("busy")
        bench.check_frame(*SIZES[turn % len(SIZES)])
