#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The stereo peripheral in Verilator with memory at its ports, as software sees it."""

from __future__ import annotations

import dataclasses
from unittest.mock import patch

import numpy as np
from litedram.common import LiteDRAMNativePort
from litex.gen import LiteXModule
from litex.soc.interconnect import wishbone
from migen import ClockDomain, Signal

from litestereo.gateware.common.parameters import FEATURES, MAX_PREFILTER_CAP, MIN_BLOCK_SIZE, MatcherParameters
from litestereo.gateware.matcher.frame_settings import NO_CHECK, frame_settings
from litestereo.gateware.peripherals import stereo_peripheral
from litestereo.gateware.peripherals.stereo_crossing import StereoPeripheralCrossing
from litestereo.gateware.peripherals.stereo_peripheral import ERROR_NONE, StereoPeripheral
from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.models.stereo_bm import stereo_bm

from .memory import Memory, port_pins, slave
from .pairs import textured_pair
from .settings import SettingDraws

MAX_WIDTH, DISPARITIES, MAX_BLOCK = 48, 16, 9
MEMORY_BYTES = 1 << 15
ROWS, MAX_RECTIFIED = 24, 40  # Of a rectification: rows of its rings, rows of the highest frame.
BASES        = ("left_base", "right_base", "disparity_base")


def registers(width, height, settings):
    """Return the registers of a frame, without its addresses."""
    return {
        "width":             width,
        "height":            height,
        "disparities":       settings.disparities,
        "block_size":        settings.block_size,
        "min_disparity":     settings.min_disparity,
        "prefilter_cap":     settings.prefilter_cap,
        "texture_threshold": settings.texture_threshold,
        "uniqueness_ratio":  settings.uniqueness_ratio,
        "disp12_max_diff":   settings.disp12_max_diff if settings.disp12_max_diff >= 0 else NO_CHECK,
        "xsobel":            int(settings.prefilter == "xsobel"),
        "subpixel":          int(settings.subpixel),
        "median":            int(settings.median),
    }


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

# The same peripheral, with a separate clock for the matcher.
CROSSED = {f"{name} crossed": PORTS[name] for name in ("wishbone-32", "native-64")}

# The same peripheral, with the registers of one with a large matcher.
FAR = {"native-32 far": PORTS["native-32"]}


def built(features, cap=MAX_PREFILTER_CAP):
    """Return the parameters of a peripheral with these stages."""
    return MatcherParameters(MAX_WIDTH, disparities=DISPARITIES, max_block_size=MAX_BLOCK, max_prefilter_cap=cap,
                             features=features, rectification_rows=ROWS, rectification_height=MAX_RECTIFIED)


class Crossed(LiteXModule):
    """The peripheral, with clock and reset of its matcher as inputs."""
    def __init__(self, *arguments, **options):
        self.matcher_clk, self.matcher_rst = Signal(), Signal()
        self.cd_matcher  = ClockDomain()
        self.peripheral  = StereoPeripheralCrossing(*arguments, clock_domain="matcher", **options)
        self.comb += [self.cd_matcher.clk.eq(self.matcher_clk), self.cd_matcher.rst.eq(self.matcher_rst)]


class Bench:
    """The peripheral with memory at its ports, and a frame as software sees it."""
    def __init__(self, kind, rng, features=FEATURES, cap=MAX_PREFILTER_CAP):
        make     = (PORTS | CROSSED | FAR)[kind]
        ports    = dict(zip(("read", "write"), make(), strict=True))
        images   = {name: make()[1] for name in ("left_out", "right_out") if "rectification" in features}
        self.crossed = kind in CROSSED
        self.errs    = kind.startswith("wishbone") # The bus can answer with an error.
        with patch.object(stereo_peripheral, "NEAR_DISPARITIES", 0 if kind in FAR else DISPARITIES):
            top = (Crossed if self.crossed else StereoPeripheral)(
                ports["read"], ports["write"], built(features, cap), burst_bytes=64, with_csr=False,
                image_ports=tuple(images.values()))
        ports   |= {f"{name}_memory": port for name, port in images.items()}
        self.dut = dut = top.peripheral if self.crossed else top
        settings = [name for name, _ in frame_settings(features)]
        inputs   = {name: getattr(dut, name) for name in (*settings, "start", "abort")}
        status   = ["busy", "done", "failed", "error_code", "clocks", "first_row_clocks", "frames"]
        if images:
            status += ["dropped", "row_gone", "folded"]
            inputs |= {f"load_{name}": getattr(dut.load, name)
                       for name in ("valid", "camera", "grid", "node", "column", "row")}
        outputs  = {name: getattr(dut, name) for name in status}
        if self.crossed:
            inputs  |= {name: getattr(top, name) for name in ("matcher_clk", "matcher_rst")}
        inputs  |= {f"pairs_{name}": getattr(dut.pairs, name) for name in ("valid", "first", "last", "left", "right")}
        outputs |= {"pairs_ready": dut.pairs.ready}
        outputs |= {f"map_{name}": getattr(dut.map, name) for name in ("valid", "last", "disparity")}
        for name, port in ports.items():
            more_inputs, more_outputs = port_pins(name, port)
            inputs  |= more_inputs
            outputs |= more_outputs
        self.rng    = rng
        self.draws  = SettingDraws(rng, block_size=MAX_BLOCK, disparities=DISPARITIES,
                                   min_disparity=MAX_WIDTH - DISPARITIES - MIN_BLOCK_SIZE + 1)
        self.core   = PinCore(top, inputs, outputs)
        self.memory = Memory(MEMORY_BYTES, dut.alignment, rng)
        self.slaves = [slave(self.core, name, port, self.memory) for name, port in ports.items()]
        self.clocks = 0
        self.paces  = [(0.3, 1.0), (1.0, 1.0), (1.0, 3.0)]
        self.reset()

    def reset(self):
        """Reset both clock domains, with some clocks of overlap."""
        self.pace, self.due = 1.0, 0.0  # Clocks of the matcher per clock of the ports, and the fraction that remains.
        for _ in range(4):
            self.matcher_clocks(1, matcher_rst=1)
            self.core.reset()
        self.matcher_clocks(1, matcher_rst=0)
        for one in self.slaves:
            one.reset()

    def matcher_clocks(self, count, **inputs):
        """Advance the matcher's separate clock, if it has one."""
        if self.crossed:
            self.core.set(**inputs)
            for _ in range(count):
                self.core.set(matcher_clk=1)
                self.core.set(matcher_clk=0)

    def clock(self):
        if self.clocks % 400 == 0:
            self.pace = self.rng.uniform(*self.rng.choice(self.paces))
        self.due += self.pace
        self.matcher_clocks(int(self.due))
        self.due -= int(self.due)
        for one in self.slaves:
            one.step()
        events = [name for name in ("done", "failed") if self.core.get(name)]
        self.core.clock()
        self.clocks += 1
        return events

    def abort(self):
        """Mark an abort: whoever runs the clock sets it."""

    def fail(self):
        """Let the next access to memory fail."""
        self.memory.fail_after = 0

    def draw(self, width, block_size):
        """Draw any settings that suit the size: what is too large for the width becomes its largest."""
        settings = self.draws.settings()
        room     = width - DISPARITIES - block_size + 1
        return dataclasses.replace(settings, block_size=block_size, min_disparity=min(settings.min_disparity, room))

    def begin(self, width, height, block_size=5, changes=None, settings=None):
        """Write a pair to memory and start; return the expected map and its address."""
        settings = settings or self.draw(width, block_size)
        pixels = width*height
        step   = self.dut.alignment
        places = [128*step, 128*step + 4096, 128*step + 8192 + step*self.rng.randrange(8)]
        pair   = textured_pair(width, height, np.random.default_rng(self.rng.getrandbits(32)), 5)
        for base, image in zip(places, pair, strict=False):
            self.memory.bytes[base:base + pixels] = image.tobytes()
        self.memory.reads.clear()
        self.memory.writes.clear()
        self.core.set(**dict(zip(BASES, places, strict=True)), **registers(width, height, settings))
        self.core.set(streamed=0)
        self.core.set(**(changes or {}))
        self.pulse("start")
        return stereo_bm(*pair, settings) if not changes else None, places

    def begin_streamed(self, width, height, block_size=5):
        """Start a streamed frame; return its pair, the expected map and the map's address."""
        settings       = self.draw(width, block_size)
        pair           = textured_pair(width, height, np.random.default_rng(self.rng.getrandbits(32)), 5)
        _, places      = self.begin(width, height, changes=registers(width, height, settings) | {"streamed": 1})
        return pair, stereo_bm(*pair, settings), places

    def stream(self, pair, chance, limit=60000):
        """Stream a pair, a pixel per clock with that chance; return the last event and the map from the source."""
        left, right = (image.ravel().tolist() for image in pair)
        place, offered, beside = 0, False, []
        for _ in range(limit):
            offered = place < len(left) and (offered or self.rng.random() < chance)
            if offered:
                self.core.set(pairs_left=left[place], pairs_right=right[place], pairs_first=int(place == 0),
                              pairs_last=int(place == len(left) - 1))
            self.core.set(pairs_valid=int(offered))
            if offered and self.core.get("pairs_ready"):
                place, offered = place + 1, False
            if self.core.get("map_valid"):
                beside.append((self.core.get("map_disparity"), self.core.get("map_last")))
            if events := self.clock():
                self.core.set(pairs_valid=0)
                return events, beside
        raise AssertionError(f"no end after {limit} clocks, {place} of {len(left)} pairs taken")

    def check_streamed(self, width, height, block_size=5, chance=1.0):
        """Check a whole streamed frame: the map is correct in memory and at the source, and no image is read."""
        pair, expected, places = self.begin_streamed(width, height, block_size)
        events, beside         = self.stream(pair, chance)
        assert events == ["done"]
        assert np.array_equal(self.map_at(places[2], expected.shape), expected)
        assert [disparity for disparity, _ in beside] == (expected.astype(int) & 0xffff).ravel().tolist()
        assert [last for _, last in beside] == [0]*(expected.size - 1) + [1]
        assert self.memory.reads == []

    def pulse(self, name):
        self.core.set(**{name: 1})
        events = self.clock()
        self.core.set(**{name: 0})
        return events

    def end(self, limit=60000):
        """Run until the frame ends; return the event."""
        for _ in range(limit):
            if events := self.clock():
                assert not self.core.get("busy")
                return events
        raise AssertionError(f"no end after {limit} clocks")

    def map_at(self, base, shape):
        size = 2*shape[0]*shape[1]
        return np.frombuffer(bytes(self.memory.bytes[base:base + size]), "<i2").reshape(shape)

    def check_frame(self, width, height, block_size=5):
        """Check a whole frame: the map is correct, and nothing but it and the padding of its last word changes."""
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


def break_off(bench, pair, clocks, event):
    """Stream a pair for some clocks, break the frame off, and stream on until it has ended; return how it ended."""
    left, right = (image.ravel().tolist() for image in pair)
    place, ended = 0, []
    for clock in range(clocks + 3000):
        if clock == clocks:
            event()
        if place < len(left):
            bench.core.set(pairs_left=left[place], pairs_right=right[place], pairs_first=int(place == 0),
                           pairs_last=int(place == len(left) - 1))
        bench.core.set(pairs_valid=int(place < len(left)), abort=int(clock == clocks and event == bench.abort))
        place += place < len(left) and bench.core.get("pairs_ready")
        given = bench.core.get("map_valid")
        assert not (given and event == bench.abort and clock > clocks + 3), "a pixel long after the abort"
        if ended := bench.clock():
            break
    bench.core.set(pairs_valid=0, abort=0)
    return ended
