#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The cameras in front of the matcher, driven by registers alone: pattern and sensors in, the map of a pair out."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import csr_bus
from migen import ClockDomain

from litestereo.gateware.cameras.frame_guard import DAMAGES
from litestereo.gateware.cameras.layouts import SIDES
from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.gateware.common.parameters import FEATURES
from litestereo.gateware.matcher.frame_settings import frame_settings
from litestereo.gateware.peripherals.cameras import CameraPeripheral
from litestereo.gateware.peripherals.stereo_crossing import StereoPeripheralCrossing
from litestereo.gateware.peripherals.stereo_peripheral import StereoPeripheral
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.cores.pin_core import PinCore
from support.dvp import Clock, Format, Sensor, noise_rows
from support.expected import expected_map
from support.memory import Memory, port_pins, slave
from support.opencv import same_as_opencv
from support.pairs import byte_generator, generator, textured_pair
from support.peripheral_bench import PORTS, built, registers

WIDTH, HEIGHT = 44, 14
PARAMETERS    = CameraParameters(max_width=48, max_height=32, silence_bits=16, skew_pixels=64)
SETTINGS      = MatcherSettings(16, 5)
MAP           = 0x2000
CONTROL       = ("left_enable", "right_enable", "left_pattern", "right_pattern", "select", "triggers", "free_running")
EVENTS        = ("pair", "damaged", "missed", "left_measured", "right_measured")
LIMITS        = {"silence": 3000, "clock_limit": 200, "pair_window": 2000, "flag_limit": 40, "drop_limit": 100}


class Top(LiteXModule):
    """Cameras and matcher, as the SoC connects them; the matcher may have a separate clock."""
    def __init__(self, crossed: bool) -> None:
        self.ports = dict(zip(("read", "write"), PORTS["native-32"](), strict=True))
        if crossed:
            self.cd_matcher = ClockDomain()
            self.stereo     = StereoPeripheralCrossing(*self.ports.values(), built(FEATURES), "matcher", 64,
                                                       with_csr=False)
        else:
            self.stereo     = StereoPeripheral(*self.ports.values(), built(FEATURES), 64, with_csr=False)
        self.cameras = cameras = CameraPeripheral(PARAMETERS)
        self.bus     = csr_bus.Interface(data_width=32, address_width=14)
        self.bank    = csr_bus.CSRBank(cameras.get_csrs(sort=True), bus=self.bus)
        self.comb += [
            cameras.source.connect(self.stereo.pairs),
            cameras.open.eq(self.stereo.takes_pairs()),
        ]


class Side:
    """A sensor at the pins of a camera, with the clock of its pixels."""

    def __init__(self, name: str) -> None:
        self.name   = name
        self.period = 2.5  #: of the pixel clock, in clocks of the system
        self.due    = 0.0
        self.form   = Format()
        self.script: Iterator[Clock] = iter(())

    def edges(self, now: int) -> Iterator[dict[str, int]]:
        """Yield the pins at each edge of the pixel clock up to a clock of the system."""
        while self.due <= now:
            self.due += self.period
            pins = next(self.script, Clock()).pins(self.form)
            yield {f"{self.name}_{name}": value for name, value in pins.items()}


class Bench:
    """The SoC's part in Verilator, with memory."""

    def __init__(self, crossed: bool = False) -> None:
        self.top    = top = Top(crossed)
        self.crossed = crossed
        cameras, stereo = top.cameras, top.stereo
        inputs      = {name: getattr(top.bus, name) for name in ("adr", "we", "re", "dat_w")}
        inputs     |= {f"stereo_{name}": getattr(stereo, name) for name, _ in frame_settings(FEATURES)}
        inputs     |= {f"stereo_{name}": getattr(stereo, name) for name in ("start", "abort")}
        inputs     |= {f"others_{name}": getattr(cameras.others, name) for name in ("valid", "left", "right", "last")}
        inputs     |= {"scl_i": cameras.scl_i}
        if crossed:
            inputs |= {"matcher_clk": top.cd_matcher.clk, "matcher_rst": top.cd_matcher.rst}
        outputs     = {"dat_r": top.bus.dat_r, "busy": stereo.busy, "done": stereo.done, "failed": stereo.failed,
                       "irq": cameras.ev.irq, "others_ready": cameras.others.ready, "trigger": cameras.trigger,
                       "scl_low": cameras.scl_low, "begins": cameras.join.begins}
        for number, (side, camera) in enumerate(zip(SIDES, cameras.cameras, strict=True)):
            inputs  |= {f"{side}_{name}": getattr(camera.sensor, name) for name in ("data", "href", "vsync")}
            inputs  |= {f"{side}_clk": camera.pixel_clk, f"{side}_sda_i": cameras.sda_i[number]}
            outputs |= {f"{side}_sda_low": cameras.sda_low[number], f"{side}_sleep": cameras.sleep[number],
                        f"{side}_restart": cameras.restart[number]}
        for name, port in top.ports.items():
            more_inputs, more_outputs = port_pins(name, port)
            inputs  |= more_inputs
            outputs |= more_outputs
        self.core   = PinCore(top, inputs, outputs)
        self.memory = Memory(1 << 14, 4, byte_generator(480), speed=0.8)
        self.slaves = [slave(self.core, name, port, self.memory) for name, port in top.ports.items()]
        self.sides  = [Side(name) for name in SIDES]
        self.places: dict[str, tuple[int, int]] = {}
        place = 0
        for csr in top.cameras.get_csrs(sort=True):
            words = -(-csr.size//32)
            self.places[csr.name] = place, words
            place += words

    def restart(self, form: Format | None = None) -> None:
        """Reset all, and write the limits."""
        self.now = 0
        for side in self.sides:
            side.period, side.due, side.script, side.form = 2.5, 0.0, iter(()), form or Format()
        self.core.set(stereo_start=0, stereo_abort=0, others_valid=0, we=0, re=0)
        for reset in (1, 1, 1, 0):
            self.core.hold_reset(reset)
            if self.crossed:
                self.core.set(matcher_rst=reset)
            self.clock()
        self.clocks(60 if self.crossed else 0)
        for one in self.slaves:
            one.reset()
        self.write("size", WIDTH | HEIGHT << 16)
        for name, value in LIMITS.items():
            self.write(name, value)
        for side in SIDES:
            self.write(f"{side}_format", sum(value << bit for bit, value in enumerate(
                (form or Format()).pins().values())))

    def clock(self) -> None:
        """Run for a clock of the system, and the edges of both pixel clocks before it."""
        for side in self.sides:
            for pins in side.edges(self.now):
                self.core.set(**pins, **{f"{side.name}_clk": 1})
                self.core.set(**{f"{side.name}_clk": 0})
        # Three clocks of a separate matcher in two of the system.
        for _ in range((1 + self.now % 2) if self.crossed else 0):
            self.core.set(matcher_clk=1)
            self.core.set(matcher_clk=0)
        for one in self.slaves:
            one.step()
        self.core.clock()
        self.now += 1

    def clocks(self, count: int) -> None:
        """Run for some clocks."""
        for _ in range(count):
            self.clock()

    def write(self, name: str, value: int) -> None:
        """Write a register of the cameras."""
        self.core.set(adr=self.places[name][0], dat_w=value, we=1)
        self.clock()
        self.core.set(we=0)
        self.clock()

    def read(self, name: str) -> int:
        """Read a register of the cameras, the high words first."""
        place, words = self.places[name]
        value = 0
        for word in range(words):
            self.core.set(adr=place + word, re=1)
            self.clock()
            self.core.set(re=0)
            value = value << 32 | self.core.get("dat_r")
        return value

    def control(self, **fields: int) -> None:
        """Write the switches."""
        self.write("control", sum(fields.get(name, 0) << bit for bit, name in enumerate(CONTROL)))

    def start(self, settings: MatcherSettings = SETTINGS, width: int = WIDTH, height: int = HEIGHT) -> None:
        """Start the matcher with a streamed frame."""
        values = registers(width, height, settings) | {"streamed": 1, "disparity_base": MAP}
        self.core.set(**{f"stereo_{name}": value for name, value in values.items()})
        self.pulse("start")

    def pulse(self, name: str) -> None:
        """Give a command to the matcher."""
        self.core.set(**{f"stereo_{name}": 1})
        self.clock()
        self.core.set(**{f"stereo_{name}": 0})

    def end(self, clocks: int = 30000) -> bool:
        """Wait for the end of the matcher's frame; return whether it was good."""
        for _ in range(clocks):
            if self.core.get("done") or self.core.get("failed"):
                good = bool(self.core.get("done"))
                self.clock()
                return good
            self.clock()
        raise AssertionError("no end")

    def map(self) -> np.ndarray:
        """Return the map in memory."""
        data = self.memory.bytes[MAP:MAP + 2*WIDTH*HEIGHT]
        return np.frombuffer(bytes(data), "<i2").reshape(HEIGHT, WIDTH)

    def events(self) -> set[str]:
        """Return the events that pend, and clear them."""
        pending = self.read("ev_pending")
        self.write("ev_pending", pending)
        return {name for bit, name in enumerate(EVENTS) if pending >> bit & 1}

    def pattern(self, disparity: int, row_blanking: int = 24, frame_blanking: int = 900, **fields: int) -> None:
        """Show the pattern on both cameras."""
        self.control()
        self.clocks(20)
        self.write("pattern", disparity | row_blanking << 16)
        self.write("pattern_blanking", frame_blanking)
        self.control(**dict.fromkeys((*CONTROL[:5], "free_running"), 1) | fields)


@pytest.fixture(scope="module")
def bench():
    """Return the SoC's part in Verilator."""
    bench = Bench()
    yield bench
    bench.core.close()


@pytest.mark.parametrize("disparity", [0, 7, 15])
def test_pattern(bench, disparity):
    """The map of a frame of the pattern is cv2.StereoBM's of the noise, and the pair is told."""
    bench.restart()
    bench.pattern(disparity)
    left, right = noise_rows(WIDTH, HEIGHT, 0), noise_rows(WIDTH, HEIGHT, disparity)
    numbers = []
    for settings in (SETTINGS, MatcherSettings(16, 7, uniqueness_ratio=0, texture_threshold=0)):
        bench.start(settings)
        assert bench.end()
        assert np.array_equal(bench.map(), expected_map(left, right, settings))
        same_as_opencv(bench.map(), left, right, settings)
        # A sensor ends its frame after its last row.
        bench.clocks(200)
        assert bench.read("flags") == 0 and bench.read("exposed") == 0
        numbers.append(bench.read("number"))
        stamps = [bench.read(f"{side}_stamp") for side in SIDES]
        assert bench.read("skew") == (stamps[1] - stamps[0]) % 2**32 and abs(stamps[1] - stamps[0]) <= 40
        assert "pair" in (events := bench.events()) and "damaged" not in events
    assert numbers[1] > numbers[0] >= 1
    assert bench.read("pair_counts") & 0xffff == 2
    bench.write("latch", 1)
    assert 0 <= bench.now - bench.read("now") <= 12


def test_a_matcher_with_a_separate_clock():
    """It takes a pair each time that it is started, also after one that was given up."""
    bench = Bench(crossed=True)
    bench.restart()
    bench.pattern(6)
    expected = expected_map(noise_rows(WIDTH, HEIGHT, 0), noise_rows(WIDTH, HEIGHT, 6), SETTINGS)
    for aborted in (False, True, False):
        bench.start()
        if aborted:
            while not bench.core.get("begins"):
                bench.clock()
            bench.clocks(700)
            bench.pulse("abort")
        assert bench.end() != aborted
        assert aborted or np.array_equal(bench.map(), expected)
    bench.clocks(200)
    assert bench.read("pair_counts") & 0xffff == 2 and bench.read("pair_losses") == 1 and bench.read("flags") == 0
    bench.core.close()


def sensors(bench: Bench, images, count: int = 1, skew: int = 0) -> None:
    """Let the sensors show images, a frame after the other, the right one late by some pixel clocks."""
    for number, (side, image) in enumerate(zip(bench.sides, images, strict=True)):
        sensor = Sensor(side.form, byte_generator(481, number), blanking=(12, 12), between=(300, 300))
        frames = [sensor.frame(image.tolist()) for _ in range(count)]
        side.script = itertools.chain(sensor.idle(skew*number), *frames, [Clock()])


@pytest.mark.parametrize("form", [Format(), Format(1, 0, 0, 1), Format(1, 1, 1, 0)], ids=str)
def test_sensors(bench, form):
    """Pixels of sensors of any format, of two clocks, come to the matcher as they are."""
    bench.restart(form)
    pair = textured_pair(WIDTH, HEIGHT, generator(482), 5)
    for period, other in ((2.0, 2.02), (1.6, 1.6), (4.0, 3.97)):
        for side, value in zip(bench.sides, (period, other), strict=True):
            side.period = value
        bench.control(left_enable=1, right_enable=1, select=1, free_running=1)
        bench.write("drop_limit", 1000)
        bench.clocks(100)
        bench.start()
        sensors(bench, pair, skew=5)
        assert bench.end()
        assert np.array_equal(bench.map(), expected_map(*pair, SETTINGS))
        bench.clocks(3000)
        assert bench.read("flags") & ~(1 << 16) == 0
    assert bench.read("left_frames") == bench.read("right_frames") == 3


def test_a_damaged_frame(bench):
    """Its pair is matched, filled, and told; the counters too."""
    bench.restart()
    left, right = textured_pair(WIDTH, HEIGHT, generator(483), 5)
    bench.control(left_enable=1, right_enable=1, select=1, free_running=1)
    bench.write("ev_enable", 1 << EVENTS.index("damaged"))
    bench.clocks(100)
    bench.start()
    sensors(bench, (left, right[:-2]))
    assert bench.end()
    filled = right.copy()
    filled[-2:] = 0
    assert np.array_equal(bench.map(), expected_map(left, filled, SETTINGS))
    assert bench.core.get("irq") and "damaged" in bench.events() and not bench.core.get("irq")
    assert bench.read("flags") == 1 << 8 + DAMAGES.index("missing_row")
    assert bench.read("right_gaps") == 2 and bench.read("left_gaps") == 0


def test_pairs_that_are_not_taken(bench):
    """Without a frame of the matcher pairs are refused and counted; one that is given up does not harm the next one."""
    bench.restart()
    bench.pattern(3)
    bench.clocks(8000)
    counts = bench.read("pair_counts")
    assert counts & 0xffff == 0 and counts >> 16 >= 2
    assert "missed" in bench.events()
    bench.start()
    while not bench.core.get("begins"):
        bench.clock()
    bench.clocks(500)
    assert bench.read("status") >> 4 == 1
    bench.pulse("abort")
    assert not bench.end(300)
    bench.start()
    assert bench.end()
    assert np.array_equal(bench.map(), expected_map(noise_rows(WIDTH, HEIGHT, 0), noise_rows(WIDTH, HEIGHT, 3),
                                                    SETTINGS))
    bench.clocks(200)
    assert bench.read("flags") == 0 and bench.read("pair_losses") == 1 and bench.read("pair_counts") & 0xffff == 1


def test_statistics(bench):
    """They are measured of each frame, matched or not, over the window."""
    bench.restart()
    bench.write("window_columns", 3 | 40 << 16)
    bench.write("window_rows", 1 | 9 << 16)
    bench.pattern(9)
    bench.clocks(7000)
    for side, shift in zip(SIDES, (0, 9), strict=True):
        window = noise_rows(WIDTH, HEIGHT, shift)[1:9, 3:40]
        assert bench.read(f"{side}_measured") >= 1
        assert bench.read(f"{side}_sum") == window.sum()
        assert bench.read(f"{side}_dark") == (window < 6).sum()
        assert bench.read(f"{side}_bright") == (window > 249).sum()
        for index, count in enumerate(np.bincount(window.ravel() >> 4, minlength=16)):
            bench.write("bin_index", index)
            assert bench.read(f"{side}_bin") == count
    assert {"left_measured", "right_measured"} <= bench.events()


def test_triggers(bench):
    """Triggers come at their period; a pair has the number and the time of its trigger."""
    bench.restart()
    bench.write("trigger_period", 6000)
    bench.write("trigger_width", 50)
    bench.pattern(4, free_running=0, triggers=1)
    bench.start()
    high = 0
    while not bench.core.get("done"):
        high += bench.core.get("trigger")
        bench.clock()
    bench.write("latch", 1)
    assert bench.read("number") == -(-high//50) >= 1
    assert 0 < bench.read("exposed") < bench.read("left_stamp") < bench.read("now")


def test_pins(bench):
    """Pins of the sensors and of I2C follow the registers; lines of I2C are only ever pulled down."""
    bench.restart()
    assert [bench.core.get(f"{side}_restart") for side in SIDES] == [1, 1]
    for value in range(16):
        bench.write("pins", value)
        assert [bench.core.get(name) for name in ("left_restart", "right_restart", "left_sleep", "right_sleep")] == [
            value >> bit & 1 for bit in range(4)]
    for value in range(128):
        bench.write("i2c", value)
        low = [bench.core.get(name) for name in ("scl_low", "left_sda_low", "right_sda_low")]
        assert low == [~value >> bit & value >> bit + 4 & 1 for bit in range(3)]
    for value in range(8):
        bench.core.set(scl_i=value & 1, left_sda_i=value >> 1 & 1, right_sda_i=value >> 2)
        bench.clocks(3)
        assert bench.read("i2c_in") == value


def test_the_clock_of_a_sensor(bench):
    """It is told whether it runs."""
    bench.restart()
    bench.clocks(50)
    assert bench.read("status") & 3 == 3
    bench.sides[1].due = 1e9
    bench.clocks(300)
    assert bench.read("status") & 3 == 1


def test_another_source(bench):
    """Without `select` the pairs of the other source are matched, and the cameras are left alone."""
    bench.restart()
    bench.pattern(3, select=0)
    pair = textured_pair(WIDTH, HEIGHT, generator(484), 5)
    bench.start()
    for number, (left, right) in enumerate(zip(*(image.ravel().tolist() for image in pair), strict=True), 1):
        bench.core.set(others_valid=1, others_left=left, others_right=right, others_last=number == WIDTH*HEIGHT)
        while not bench.core.get("others_ready"):
            bench.clock()
        bench.clock()
    bench.core.set(others_valid=0)
    assert bench.end()
    assert np.array_equal(bench.map(), expected_map(*pair, SETTINGS))
    assert bench.read("pair_counts") & 0xffff == 0


@pytest.mark.parametrize("clocks", [150, 900, 2500])
def test_reset_in_mid_frame(bench, clocks):
    """After a reset at any time all begins anew."""
    bench.restart()
    bench.pattern(5)
    bench.start()
    bench.clocks(clocks)
    bench.restart()
    assert bench.read("pair_counts") == 0 and bench.read("number") == 0
    bench.pattern(2)
    bench.start()
    assert bench.end()
    assert np.array_equal(bench.map(), expected_map(noise_rows(WIDTH, HEIGHT, 0), noise_rows(WIDTH, HEIGHT, 2),
                                                    SETTINGS))
