#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher from memory to memory, on each kind of port: slow memory, aborts, errors, bad settings, resets."""

from __future__ import annotations

import dataclasses
from unittest.mock import patch

import numpy as np
import pytest
from litedram.common import LiteDRAMNativePort
from litex.gen import LiteXModule
from litex.soc.interconnect import wishbone
from migen import ClockDomain, Signal

from litestereo.gateware.common.parameters import FEATURES, MAX_PREFILTER_CAP, MIN_BLOCK_SIZE, MatcherParameters
from litestereo.gateware.common.settings import MAX_HEIGHT
from litestereo.gateware.common.settings import SETTINGS as TABLE
from litestereo.gateware.matcher.frame_settings import NO_CHECK, frame_settings
from litestereo.gateware.peripherals import stereo_peripheral
from litestereo.gateware.peripherals.stereo_crossing import StereoPeripheralCrossing
from litestereo.gateware.peripherals.stereo_peripheral import (
    ERROR_ABORTED,
    ERROR_BUS,
    ERROR_CONFIG,
    ERROR_NONE,
    StereoPeripheral,
)
from litestereo.host_tools.core.settings import MatcherSettings, from_number
from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.models.stereo_bm import stereo_bm
from support.limits import Range, setting_ranges
from support.memory import Memory, port_pins, slave
from support.pairs import byte_generator, textured_pair
from support.settings import SettingDraws

MAX_WIDTH, DISPARITIES, MAX_BLOCK = 48, 16, 9
MEMORY_BYTES = 1 << 15
SETTINGS     = [name for name, _ in frame_settings()]
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
                             features=features)


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
        ports    = dict(zip(("read", "write"), (PORTS | CROSSED | FAR)[kind](), strict=True))
        self.crossed = kind in CROSSED
        self.errs    = kind.startswith("wishbone") # The bus can answer with an error.
        with patch.object(stereo_peripheral, "NEAR_DISPARITIES", 0 if kind in FAR else DISPARITIES):
            top = (Crossed if self.crossed else StereoPeripheral)(
                ports["read"], ports["write"], built(features, cap), burst_bytes=64, with_csr=False)
        self.dut = dut = top.peripheral if self.crossed else top
        inputs   = {name: getattr(dut, name) for name in (*SETTINGS, "start", "abort")}
        outputs  = {name: getattr(dut, name)
                    for name in ("busy", "done", "failed", "error_code", "clocks", "first_row_clocks", "frames")}
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


@pytest.fixture(params=[*PORTS, *CROSSED, *FAR])
def bench(request):
    rng   = byte_generator(20, request.param)
    bench = Bench(request.param, rng)
    yield bench
    bench.core.close()


SIZES = [(20, 5, 5), (21, 5, 5), (MAX_WIDTH, 9, 9), (MAX_WIDTH, 13, 7), (37, 11, 5), (24, 9, 9)]


def test_sizes(bench):
    """The smallest image, odd sizes and the maximum width work at any speed of the memory."""
    for speed in (1.0, 0.6, 0.15):
        bench.memory.speed = speed
        for size in SIZES:
            bench.check_frame(*size)
    assert bench.core.get("frames") == 3*len(SIZES)
    bench.draws.check()


def test_counts_clocks(bench):
    """`clocks` counts the clocks from start to done, and the first row comes before the end."""
    bench.begin(MAX_WIDTH, 9)
    start = bench.clocks
    assert bench.end() == ["done"]
    assert bench.core.get("clocks") == bench.clocks - start
    assert 5*MAX_WIDTH < bench.core.get("first_row_clocks") < bench.core.get("clocks")


def test_a_faster_clock_is_a_faster_frame():
    """The matcher's clock sets the pace if memory keeps up: twice the frequency nearly halves the clocks."""
    bench  = Bench("native-64 crossed", byte_generator(25))
    clocks = []
    for pace in (1.0, 2.0):
        bench.paces, bench.pace = [(pace, pace)], pace
        bench.check_frame(MAX_WIDTH, 60)
        clocks.append(bench.core.get("clocks"))
    assert clocks[0] < 1.3*MAX_WIDTH*60
    assert clocks[1] < 0.55*clocks[0]
    bench.core.close()


def test_abort_and_restart(bench):
    """A frame aborted at any clock ends soon, and the next one is correct."""
    for number in range(25):
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
        bench.check_frame(*SIZES[number % len(SIZES)])


def test_abort_at_once(bench):
    """An abort is effective from the first clock of a frame, before any request to memory."""
    for wait in range(10):
        bench.begin(33, 11)
        events = [event for _ in range(wait) for event in bench.clock()]
        assert (events + bench.pulse("abort") or bench.end(500)) == ["failed"]
        assert bench.core.get("error_code") == ERROR_ABORTED
        bench.check_frame(33, 11)


def test_abort_while_idle(bench):
    """An abort without a frame does nothing."""
    assert bench.pulse("abort") == []
    assert not any(bench.clock() for _ in range(50))
    bench.check_frame(30, 8)


def test_start_while_busy(bench):
    """A start during a frame is ignored."""
    expected, places = bench.begin(30, 8)
    before = bytes(bench.memory.bytes)
    for _ in range(60):
        assert bench.pulse("start") == []
    assert bench.end() == ["done"]
    bench.check_result(expected, places, before)
    assert not any(bench.clock() for _ in range(200))


def test_streamed(bench):
    """Streamed frames alternate with frames from memory, at any speed of stream and memory."""
    for number, size in enumerate(SIZES[1:4]):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        bench.check_streamed(*size, chance=bench.rng.choice([1.0, 0.7, 0.2]))
        if number % 2:
            bench.check_frame(*size)


def test_abort_of_streamed_frames(bench):
    """A streamed frame aborted at any clock ends soon, with pairs on offer or not, and the next one is correct."""
    for number in range(6):
        pair, *_ = bench.begin_streamed(33, 11)
        left     = pair[0].ravel().tolist()
        events   = []
        for place in range(bench.rng.randrange(len(left))):
            bench.core.set(pairs_valid=1, pairs_left=left[place], pairs_right=0, pairs_first=int(place == 0))
            events += bench.clock()
        bench.core.set(pairs_valid=number % 2)
        events += bench.pulse("abort") or bench.end(2000)
        assert events == ["failed"] and bench.core.get("error_code") == ERROR_ABORTED
        assert not bench.core.get("pairs_ready")
        bench.core.set(pairs_valid=0)
        (bench.check_streamed if number % 3 else bench.check_frame)(*SIZES[number % len(SIZES)])


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


def test_a_streamed_frame_after_one_that_was_broken_off(bench):
    """Nothing of a frame that was aborted, or hit a bus error, at any clock comes up in the next one."""
    for number in range(24 if bench.crossed else 6):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        pair, *_ = bench.begin_streamed(33, 11)
        clocks   = bench.rng.choice([number, bench.rng.randrange(60), bench.rng.randrange(600)])
        ended    = break_off(bench, pair, clocks, bench.abort if number % 3 or not bench.errs else bench.fail)
        bench.memory.fail_after = None
        assert ended in (["failed"], ["done"])
        assert not bench.core.get("map_valid")
        bench.check_streamed(*SIZES[number % 4], chance=bench.rng.choice([1.0, 0.4]))


def test_pairs_of_the_next_streamed_frame_wait(bench):
    """Pairs offered after a frame's last one are the next frame's, whenever that begins."""
    frames = [bench.begin_streamed(24, 9)]
    for number in range(4):
        bench.memory.speed = bench.rng.choice([1.0, 0.3])
        pair, expected, places = frames[-1]
        left, right = (image.ravel().tolist() for image in pair)
        place = 0
        for _ in range(60000):
            mine = place < len(left)
            bench.core.set(pairs_valid=1, pairs_left=left[place] if mine else 77,
                           pairs_right=right[place] if mine else 9, pairs_first=int(place in (0, len(left))),
                           pairs_last=int(place == len(left) - 1))
            if bench.core.get("pairs_ready"):
                assert mine, "a pair of the next frame"
                place += 1
            if events := bench.clock():
                break
        assert events == ["done"] and not bench.core.get("pairs_ready")
        assert np.array_equal(bench.map_at(places[2], expected.shape), expected)
        bench.core.set(pairs_valid=0)
        frames.append(bench.begin_streamed(20 + number, 6))


def test_pairs_wait_while_no_streamed_frame_is_under_way(bench):
    """Pairs are neither accepted between frames nor by a frame from memory."""
    bench.core.set(pairs_valid=1)
    for _ in range(20):
        assert not bench.core.get("pairs_ready")
        bench.clock()
    bench.check_frame(30, 8)
    assert not bench.core.get("pairs_ready")


def test_settings_of_the_next_frame(bench):
    """Registers written during a frame apply to the next frame, never to the current one."""
    for number in range(12):
        expected, places = bench.begin(33, 11, 7)
        before = bytes(bench.memory.bytes)
        events = [event for _ in range(bench.rng.randrange(300)) for event in bench.clock()]
        width = 20 + number
        bench.core.set(left_base=0, right_base=0, disparity_base=0, **registers(width, 6, bench.draw(width, 5)))
        assert (events or bench.end()) == ["done"]
        bench.check_result(expected, places, before)


PLAIN = MatcherSettings(DISPARITIES, 5, disp12_max_diff=1)


def check_refused(bench, changes):
    """Check that a frame is refused before any access to memory, and that the next one is correct."""
    bench.begin(30, 8, changes=changes, settings=PLAIN)
    assert bench.end(100) == ["failed"]
    assert bench.core.get("error_code") == ERROR_CONFIG
    assert not bench.memory.reads and not bench.memory.writes
    bench.check_frame(30, 8)


#: Ranges of the registers for a frame of 30 x 8 pixels, as its width and height narrow them; then those of its size.
#: The check's register has no illegal value: 255 is off.
FRAME_RANGES = setting_ranges(disparities=DISPARITIES, block_size=7, min_disparity=30 - DISPARITIES - 5 + 1)
SIZE_RANGES  = {"width": Range(DISPARITIES + 5 - 1, MAX_WIDTH), "height": Range(5, MAX_HEIGHT)}

ILLEGAL  = [{name: value} for name, one in SIZE_RANGES.items() for value in one.beyond(0, 0xffff)]
ILLEGAL += [{one.name: value} for one in TABLE if not one.option and one.register_off is None
            for value in FRAME_RANGES[one.name].beyond(0, 2**one.bits - 1)]
ILLEGAL += [{"disparities": 8}, {"left_base": 2}, {"right_base": 129}, {"disparity_base": 1}, {"disparity_base": 131}]


@pytest.mark.parametrize("changes", ILLEGAL, ids=str)
def test_bad_settings(changes):
    """Bad settings are refused before any access to memory, and the next frame is correct."""
    bench = Bench("wishbone-32", byte_generator(21, str(changes)))
    check_refused(bench, changes)
    bench.core.close()


@pytest.mark.parametrize("kind", ["wishbone-32", "wishbone-32 crossed"])
def test_another_height(kind):
    """A largest height that no register reports is refused when the peripheral is built."""
    parameters = MatcherParameters(MAX_WIDTH, 100, DISPARITIES, MAX_BLOCK)
    with pytest.raises(ValueError, match="max_height of the peripheral must be 4095, not 100"):
        if kind in CROSSED:
            StereoPeripheralCrossing(*CROSSED[kind](), parameters, clock_domain="matcher")
        else:
            StereoPeripheral(*PORTS[kind](), parameters)


@pytest.mark.parametrize("name", FRAME_RANGES)
def test_limits_of_settings(name):
    """Values at every limit of a setting are accepted, and give the model's map."""
    bench = Bench("wishbone-32", byte_generator(23, name))
    for value in FRAME_RANGES[name].limits:
        settings         = dataclasses.replace(PLAIN, **{name: from_number(name, value)})
        expected, places = bench.begin(30, 8, settings=settings)
        assert bench.end() == ["done"], settings
        assert np.array_equal(bench.map_at(places[2], expected.shape), expected), settings
    bench.core.close()


def test_a_smaller_cap():
    """A cap above the one that is built is refused, unless the prefilter is off; that one and less are accepted."""
    bench = Bench("wishbone-32", byte_generator(23), cap=36)
    for cap, xsobel, event in [(36, 1, "done"), (37, 1, "failed"), (35, 1, "done"), (63, 1, "failed"), (63, 0, "done")]:
        bench.begin(30, 8, changes={"prefilter_cap": cap, "xsobel": xsobel}, settings=PLAIN)
        assert bench.end() == [event], (cap, xsobel)
    bench.core.close()


def test_an_unused_cap():
    """Without prefilter its cap may have any value, even an illegal one."""
    bench = Bench("wishbone-32", byte_generator(23))
    bench.begin(30, 8, changes={"prefilter_cap": 0, "xsobel": 0}, settings=PLAIN)
    assert bench.end() == ["done"]
    bench.core.close()


BARE = {"xsobel": 0, "texture_threshold": 0, "uniqueness_ratio": 0, "disp12_max_diff": NO_CHECK, "subpixel": 0}


@pytest.mark.parametrize("features, base, missing", [
    (("raw",), BARE, [{"xsobel": 1}, {"uniqueness_ratio": 1}, {"subpixel": 1}, {"disp12_max_diff": 0},
                      {"min_disparity": 1}, {"median": 1}]),
    (("xsobel",), BARE | {"xsobel": 1}, [{"xsobel": 0}, {"texture_threshold": 1}]),
], ids=["raw", "xsobel"])
@pytest.mark.long
def test_stages_that_are_not_built(features, base, missing):
    """A frame that needs a missing stage is refused; without that stage it is matched."""
    bench = Bench("wishbone-32", byte_generator(24, *features), features)
    for changes in missing:
        bench.begin(30, 8, changes=base | changes, settings=PLAIN)
        assert bench.end(100) == ["failed"]
        assert bench.core.get("error_code") == ERROR_CONFIG
    bare = MatcherSettings(DISPARITIES, 5, 0, "xsobel" if base["xsobel"] else "none", texture_threshold=0,
                          uniqueness_ratio=0, subpixel=False)
    expected, places = bench.begin(30, 8, settings=bare)
    before = bytes(bench.memory.bytes)
    assert bench.end() == ["done"]
    bench.check_result(expected, places, before)
    bench.core.close()


@pytest.mark.parametrize("kind", ["wishbone-32", "wishbone-128", "wishbone-32 crossed"])
def test_bus_error(kind):
    """An error on any access ends the frame with its code, and the next one is correct."""
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
    """After a reset of the whole core at any clock the next frame is correct."""
    for number in range(15):
        bench.memory.speed = bench.rng.choice([1.0, 0.4])
        bench.begin(33, 11)
        for _ in range(bench.rng.randrange(900)):
            bench.clock()
        bench.reset()
        assert not bench.core.get("busy")
        bench.check_frame(*SIZES[number % len(SIZES)])
