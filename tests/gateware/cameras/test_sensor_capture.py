#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SensorCapture: from the signals of a sensor to frames of the system, for any two clocks; also of the test pattern."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import pytest
from litex.gen import LiteXModule
from migen import ClockDomain, ClockDomainsRenamer, Signal

from litestereo.gateware.cameras import test_pattern
from litestereo.gateware.cameras.frame_guard import DAMAGES
from litestereo.gateware.cameras.pair_matcher import PairMatcher
from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.gateware.cameras.sensor_capture import SensorCapture
from support.dvp import FORMATS, Clock, Format, Rows, Sensor, damaged, drawn_rows, guarded, noise_rows
from support.packed_core import PackedCore
from support.pairs import byte_generator
from support.two_clocks import Side, TwoClocks

WIDTH, HEIGHT = 12, 6
PARAMETERS    = CameraParameters(max_width=16, max_height=8, silence_bits=12)
SILENCE       = 600
LIMIT         = 100


class Top(LiteXModule):
    """The capture, with clock and reset of both sides as inputs."""
    def __init__(self) -> None:
        self.cd_pixel = ClockDomain("pixel")
        self.cd_other = ClockDomain("other")
        self.capture  = ClockDomainsRenamer({"sys": "other"})(SensorCapture(PARAMETERS, "pixel"))


class Bench:
    """The capture with its two clocks."""

    def __init__(self, rng) -> None:
        top = Top()
        capture, guard = top.capture, top.capture.guard
        inputs = {"pixel_clk": top.cd_pixel.clk, "pixel_rst": top.cd_pixel.rst, "sys_clk": top.cd_other.clk,
                  "sys_rst": top.cd_other.rst, "take": capture.source.ready}
        inputs |= {name: getattr(capture.sensor, name) for name in ("data", "href", "vsync")}
        inputs |= {name: getattr(capture.format, name) for name in Format().pins()}
        inputs |= {name: getattr(guard, name) for name in ("width", "height", "silence", "accept")}
        inputs |= {"limit": capture.watch.limit}
        source  = capture.source
        self.core = PackedCore(top, inputs, {
            "offered": source.valid, "out": source.pixel, "first": source.first, "last": source.last,
            "starts": capture.starts, "begun": guard.begun, "ended": guard.ended, "flags": guard.flags,
            "runs": capture.watch.runs,
        } | {f"{name}_total": total for name, total in capture.totals.items()} | {"lost": capture.crossing.lost})
        self.rng    = rng
        self.pixel  = Side(lambda: self.edge("pixel", self.show), lambda value: self.core.set(pixel_rst=value))
        self.system = Side(lambda: self.edge("sys", self.take), lambda value: self.core.set(sys_rst=value))
        self.clocks = TwoClocks(self.pixel, self.system, rng)
        self.form   = Format()
        self.takes  = 1.0
        self.script: Iterator[Clock] = iter(())
        self.shown = Clock()
        self.forget()

    def forget(self) -> None:
        """Begin to record anew."""
        self.frames: list[list[int]] = []
        self.flags:  list[int] = []
        self.starts  = 0

    def edge(self, name: str, act) -> None:
        act()
        self.core.set(**{f"{name}_clk": 1})
        self.core.set(**{f"{name}_clk": 0})

    def show(self) -> None:
        self.shown = next(self.script, self.shown)
        self.core.set(**self.shown.pins(self.form))

    def take(self) -> None:
        take = self.rng.random() < self.takes
        self.core.set(take=take)
        out = self.core.get()
        self.starts += out["starts"]
        if take and out["offered"]:
            if out["first"]:
                self.frames.append([])
            self.frames[-1].append(out["out"])
            assert out["last"] == (len(self.frames[-1]) == WIDTH*HEIGHT)
        if out["ended"]:
            assert len(self.frames[-1]) == WIDTH*HEIGHT
            self.flags.append(out["flags"])

    def restart(self, form: Format, pixel: float, system: float) -> Sensor:
        """Reset both sides with clocks of these periods, and return a sensor."""
        self.form, self.script, self.shown, self.takes = form, iter(()), Clock(), 1.0
        self.pixel.stopped = False
        self.pixel.period, self.system.period = pixel, system
        self.core.set(**form.pins(), width=WIDTH, height=HEIGHT, silence=SILENCE, accept=1, limit=LIMIT)
        self.clocks.reset()
        self.clocks.run(20.0)
        self.clocks.release()
        self.clocks.run(150.0)
        self.forget()
        return Sensor(form, self.rng, blanking=(4, 12), between=(16, 40))

    def play(self, clocks: Iterable[Clock]) -> None:
        """Show clocks, and wait until all has come out."""
        script = [*clocks, Clock()]
        self.script = iter(script)
        self.clocks.run(len(script)*self.pixel.period + 150.0)

    def totals(self) -> dict[str, int]:
        """Return the counts of the events."""
        return {name.removesuffix("_total"): value for name, value in self.core.get().items() if "_total" in name}


@pytest.fixture(scope="module")
def bench():
    """Return the capture in Verilator."""
    bench = Bench(byte_generator(450))
    yield bench
    bench.core.close()


#: Periods of pixel clock and system, in any unit: as 1:3, 2:5, 1:1.1, and clocks of two crystals of the same rate.
RATIOS = [(3.0, 1.0), (2.5, 1.0), (1.1, 1.0), (1.0003, 1.0), (1.0, 0.27)]


@pytest.mark.parametrize("form", FORMATS[::3], ids=str)
@pytest.mark.parametrize("pixel, system", RATIOS)
def test_frames(bench, pixel, system, form):
    """Whole and damaged frames: those of the sensor, filled and cut, with their flags and counts; all starts seen."""
    sensor = bench.restart(form, pixel, system)
    wanted: list[Rows] = []
    clocks: list[Clock] = []
    for kind in (None, "short_row", None, "long_row", "extra_row", None):
        rows = drawn_rows(WIDTH, HEIGHT, bench.rng)
        rows = damaged(rows, kind, bench.rng) if kind else rows
        wanted.append(rows)
        # A row is filled while the sensor is between rows and frames: the crossing has no room for a whole row.
        sensor.blanking = (24, 30) if kind == "short_row" else (4, 12)
        clocks += sensor.frame(rows)
    bench.play(clocks)
    expected = [guarded(rows, WIDTH, HEIGHT) for rows in wanted]
    assert bench.frames == [one.pixels for one in expected]
    assert bench.starts == len(expected)
    counts = {name: sum(one.damages[name] for one in expected) for name in DAMAGES}
    assert bench.totals() == counts | {"frames": len(expected), "dropped": 0}
    assert bench.core.get()["lost"] == 0


def test_missing_rows(bench):
    """They are filled between frames, or in the next one, which is dropped then."""
    sensor = bench.restart(Format(), 2.0, 1.0)
    rows   = [drawn_rows(WIDTH, HEIGHT, bench.rng) for _ in range(3)]
    rows[0] = rows[0][:1]
    clocks  = [*sensor.frame(rows[0]), *sensor.frame(rows[1]), *sensor.idle(100), *sensor.frame(rows[2])]
    bench.play(clocks)
    assert bench.frames[0] == guarded(rows[0], WIDTH, HEIGHT).pixels
    assert bench.frames[-1] == guarded(rows[2], WIDTH, HEIGHT).pixels and bench.flags[-1] == 0
    assert bench.starts == 3 == bench.totals()["frames"] + bench.totals()["dropped"]


@pytest.mark.parametrize("pixel, system", [(3.0, 1.0), (1.0, 1.0), (1.0, 5.0), (12.0, 1.0)])
def test_whether_the_clock_runs(bench, pixel, system):
    """It is told with and without frames, and after a reset; a clock that stops is told at the limit."""
    bench.restart(Format(), pixel, system)
    for _ in range(4):
        bench.clocks.run(bench.rng.uniform(12.0, 40.0)*pixel + 4*system)
        assert bench.core.get()["runs"]
        bench.pixel.stopped = True
        # The newest edge that counts is up to eight pixel clocks old.
        bench.clocks.run((LIMIT - 4)*system - 8*pixel)
        assert bench.core.get()["runs"]
        bench.clocks.run(8*system + 8*pixel)
        assert not bench.core.get()["runs"]
        bench.clocks.run(3.0*LIMIT*system)
        assert not bench.core.get()["runs"]
        bench.pixel.stopped = False
    bench.clocks.run(12*pixel + 4*system)
    bench.pixel.stopped = True
    bench.clocks.reset()
    bench.clocks.run(20*system)
    bench.clocks.release()
    bench.clocks.run(20*system)
    assert not bench.core.get()["runs"]


@pytest.mark.parametrize("where", ["row", "between rows"])
def test_a_clock_that_stands_still(bench, where):
    """The frame is filled and flagged; when the clock is back, the rest of it is ignored and the next one is whole."""
    sensor = bench.restart(Format(), 2.0, 1.0)
    rows   = [drawn_rows(WIDTH, HEIGHT, bench.rng) for _ in range(2)]
    first  = list(sensor.frame(rows[0]))
    marks  = [number for number, clock in enumerate(first) if clock.row == (where == "row") and clock.frame]
    stop   = marks[len(marks)//2]
    bench.script = iter(first[:stop])
    bench.clocks.run(stop*bench.pixel.period)
    bench.pixel.stopped = True
    bench.clocks.run(SILENCE + 200.0)
    assert len(bench.frames) == len(bench.flags) == 1
    assert bench.flags[0] >> DAMAGES.index("stuck") & 1
    bench.pixel.stopped = False
    bench.play([*first[stop:], *sensor.frame(rows[1])])
    assert bench.frames[1:] == [guarded(rows[1], WIDTH, HEIGHT).pixels] and bench.flags[1:] == [0]
    assert bench.totals()["stuck"] == 1 and bench.totals()["frames"] == 2


def test_a_successor_that_stalls(bench):
    """What has no room is lost, flagged and counted; the frame has all its pixels, and the next one is whole."""
    sensor = bench.restart(Format(), 1.5, 1.0)
    rows   = [drawn_rows(WIDTH, HEIGHT, bench.rng) for _ in range(2)]
    bench.takes = 0.1
    bench.play(sensor.frame(rows[0]))
    bench.takes = 1.0
    bench.play(sensor.idle(120))
    lost = bench.core.get()["lost"]
    assert lost > 0 and len(bench.frames) == len(bench.flags) == 1
    assert bench.flags[0] >> DAMAGES.index("overrun") & 1 and 0 < bench.totals()["overrun"] <= lost
    bench.play(sensor.frame(rows[1]))
    assert bench.frames[1:] == [guarded(rows[1], WIDTH, HEIGHT).pixels] and bench.flags[1:] == [0]
    assert bench.core.get()["lost"] == lost


@pytest.mark.parametrize("still", ["pixel", "system"])
def test_reset_in_mid_frame(bench, still):
    """After a reset, also while a clock is stopped, the frame under way is gone, and the next one is whole."""
    for _ in range(6):
        sensor = bench.restart(Format(vsync_low=1), bench.rng.uniform(1.1, 3.0), 1.0)
        rows   = [drawn_rows(WIDTH, HEIGHT, bench.rng) for _ in range(2)]
        first  = list(sensor.frame(rows[0]))
        # A sensor does not stop for a reset: what it shows meanwhile is lost.
        bench.script = iter([*first, *sensor.idle(100)])
        bench.clocks.run(bench.rng.uniform(0.2, 0.8)*len(first)*bench.pixel.period)
        bench.clocks.reset_without(getattr(bench, still))
        bench.clocks.run(200.0)
        bench.script = iter([Clock()])
        bench.clocks.run(300.0)
        bench.forget()
        bench.play(sensor.frame(rows[1]))
        assert bench.frames == [guarded(rows[1], WIDTH, HEIGHT).pixels] and bench.flags == [0] and bench.starts == 1


# Self test --------------------------------------------------------------------------------------------


class SelfTest(LiteXModule):
    """Two captures of test patterns, and their starts."""
    def __init__(self) -> None:
        self.cd_pixel = ClockDomain("pixel")
        self.run      = Signal()
        self.pairs    = pairs = PairMatcher()
        self.captures = []
        for number, shift in enumerate((0, 5)):
            pattern = ClockDomainsRenamer("pixel")(test_pattern.TestPattern(PARAMETERS))
            capture = SensorCapture(PARAMETERS, "pixel")
            self.submodules += pattern, capture
            self.captures.append(capture)
            self.comb += [
                capture.sensor.eq(pattern.sensor),
                pattern.run.eq(self.run),
                pattern.width.eq(WIDTH),
                pattern.height.eq(HEIGHT),
                pattern.shift.eq(shift),
                pattern.row_blanking.eq(8),
                pattern.frame_blanking.eq(30),
                capture.guard.width.eq(WIDTH),
                capture.guard.height.eq(HEIGHT),
                capture.guard.silence.eq(SILENCE),
                capture.guard.accept.eq(1),
                capture.source.ready.eq(1),
                pairs.starts[number].eq(capture.starts),
            ]
        self.comb += [
            pairs.window.eq(60),
            pairs.drop_limit.eq(8),
            pairs.free_running.eq(1),
        ]


def test_self_test():
    """The captures give the pattern, of its disparity, in each frame, and all frames are pairs without skew."""
    top  = SelfTest()
    core = PackedCore(top, {"run": top.run, "pixel_clk": top.cd_pixel.clk, "pixel_rst": top.cd_pixel.rst},
                      {f"{name}_{side}": getattr(capture.source, name) for side, capture in enumerate(top.captures)
                       for name in ("valid", "pixel", "last")}
                      | {name: getattr(top.pairs, name) for name in ("paired", "dropped", "flagged", "skew",
                                                                      "pair_number")})
    images: list[list[list[int]]] = [[[]], [[]]]
    paired = 0
    core.set(run=1)
    for clock in range(2500):
        core.set(pixel_clk=clock % 2)
        core.clock()
        out = core.get()
        for side in range(2):
            if out[f"valid_{side}"]:
                images[side][-1].append(out[f"pixel_{side}"])
                if out[f"last_{side}"]:
                    images[side].append([])
        paired += out["paired"]
        assert not out["dropped"]
        if out["paired"]:
            assert out["skew"] == 0 and not out["flagged"] and out["pair_number"] == paired
    assert paired >= 4
    for side, shift in enumerate((0, 5)):
        assert images[side][:4] == [noise_rows(WIDTH, HEIGHT, shift).ravel().tolist()]*4
    core.close()
