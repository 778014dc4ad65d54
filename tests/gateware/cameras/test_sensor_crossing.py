#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SensorCrossing: items come out in order, what is lost is told where it is missing and counted, for any two clocks."""

from __future__ import annotations

import pytest
from litex.gen import LiteXModule
from migen import Cat, ClockDomain

from litestereo.gateware.cameras.sensor_crossing import LOST_BITS, SensorCrossing
from support.packed_core import PackedCore
from support.pairs import byte_generator
from support.two_clocks import Side, TwoClocks

#: Items are numbered, modulo this.
NUMBERS = 1 << 10

#: Edges after which a side is at work again after a reset: the sides agree on it for two dozen of the slower clock.
SETTLED = 400.0


class Top(LiteXModule):
    """The crossing, with clock and reset of both sides as inputs."""
    def __init__(self) -> None:
        self.cd_pixel  = ClockDomain("pixel")
        self.cd_other  = ClockDomain("other")
        self.crossing  = SensorCrossing("pixel", "other", depth=16)


class Bench:
    """The crossing with its two clocks: a sensor that does not wait, a system that takes when it likes."""

    def __init__(self, rng) -> None:
        top    = Top()
        sink, source = top.crossing.sink, top.crossing.source
        self.core = PackedCore(top, {
            "pixel_clk": top.cd_pixel.clk, "pixel_rst": top.cd_pixel.rst, "other_clk": top.cd_other.clk,
            "other_rst": top.cd_other.rst, "valid": sink.valid, "number": Cat(sink.kind, sink.pixel),
            "take": source.ready,
        }, {"shown": source.valid, "out": Cat(source.kind, source.pixel), "gap": source.lost,
            "lost": top.crossing.lost})
        self.rng   = rng
        self.pixel = Side(lambda: self.edge("pixel", self.send), lambda value: self.core.set(pixel_rst=value))
        self.other = Side(lambda: self.edge("other", self.receive), lambda value: self.core.set(other_rst=value))
        self.clocks = TwoClocks(self.pixel, self.other, rng)
        self.sends, self.takes = 1.0, 1.0
        self.forget()

    def forget(self) -> None:
        """Begin to count anew."""
        self.sent, self.received, self.lost, self.gaps = 0, [], 0, 0

    def edge(self, name: str, act) -> None:
        act()
        self.core.set(**{f"{name}_clk": 1})
        self.core.set(**{f"{name}_clk": 0})

    def send(self) -> None:
        valid = self.rng.random() < self.sends
        self.core.set(valid=valid, number=self.sent % NUMBERS)
        self.sent += valid

    def receive(self) -> None:
        take = self.rng.random() < self.takes
        self.core.set(take=take)
        out = self.core.get()
        if take and out["shown"]:
            missing = (out["out"] - self.received[-1] - 1) % NUMBERS if self.received else 0
            if self.received:
                assert out["gap"] == (missing > 0)
            self.lost += missing
            self.gaps += missing > 0
            self.received.append(out["out"])

    def restart(self) -> None:
        """Reset both sides, and wait until they have agreed on it, while nothing is sent."""
        self.sends = 0.0
        self.clocks.reset()
        self.clocks.run(10.0)
        self.clocks.release()
        self.clocks.run(SETTLED)
        self.forget()


@pytest.fixture(scope="module")
def bench():
    """Return the crossing in Verilator."""
    bench = Bench(byte_generator(420))
    bench.restart()
    yield bench
    bench.core.close()


def drain(bench: Bench) -> None:
    """Let all that is inside come out, and the count of what was lost."""
    bench.sends, bench.takes = 0.0, 1.0
    bench.clocks.run(200.0)


@pytest.mark.parametrize("periods", [(1.0, 1.0), (3.0, 1.0), (2.5, 1.0), (1.1, 1.0), (1.0, 1.0001), (1.0, 0.7)],
                         ids=str)
def test_nothing_is_lost_with_room(bench, periods):
    """With a system that is as fast as the sensor, all items come out, in order."""
    bench.pixel.period, bench.other.period = periods
    bench.restart()
    # A clock of the same rate takes a few items more when it drifts: a sensor has blankings.
    bench.sends = 0.95
    bench.takes = 1.0
    bench.clocks.run(2000.0)
    drain(bench)
    assert bench.received == [number % NUMBERS for number in range(bench.sent)]
    assert not bench.lost and not bench.core.get()["lost"]


@pytest.mark.parametrize("takes", [0.0, 0.05, 0.3, 0.6])
def test_what_is_lost_is_counted(bench, takes):
    """With a system that is too slow, each gap is marked at its place, and the count is exact, also while all stand."""
    gaps = 0
    for _ in range(6):
        bench.clocks.draw()
        bench.restart()
        bench.sends = 1.0
        for _ in range(5):
            bench.takes = takes
            # A gap is less than the numbers of items.
            bench.clocks.run(bench.rng.uniform(10.0, 50.0))
            bench.sends = bench.rng.choice((0.0, 1.0))
        bench.sends = 0.0
        bench.clocks.run(60.0)
        count = bench.core.get()["lost"]
        bench.takes = 1.0
        bench.clocks.run(200.0)
        # The next item tells of a gap at the end.
        sent, bench.sends = bench.sent, 0.05
        while bench.sent < sent + 2:
            bench.clocks.run(5.0)
        drain(bench)
        assert bench.lost == count == bench.sent - len(bench.received)
        assert bench.core.get()["lost"] == count
        gaps += bench.gaps
    assert gaps or takes > 0.3


def test_the_count_wraps(bench):
    """It is modulo its width."""
    bench.pixel.period, bench.other.period = 1.0, 20.0
    bench.restart()
    bench.sends, bench.takes = 1.0, 0.0
    bench.clocks.run(2.0**LOST_BITS + 100.0)
    bench.sends = 0.0
    sent = bench.sent
    bench.clocks.run(100.0)
    lost = bench.core.get()["lost"]
    # What the crossing and its registers hold is not lost.
    assert 0 < (sent - lost) % 2**LOST_BITS <= 16 + 2 and sent > 2**LOST_BITS


@pytest.mark.parametrize("still", ["pixel", "other"])
def test_a_reset_while_a_clock_stands_still(bench, still):
    """It empties the crossing and clears the count; nothing of before comes out."""
    for _ in range(20):
        bench.clocks.draw()
        bench.sends, bench.takes = 1.0, 0.3
        bench.clocks.run(bench.rng.uniform(0.0, 100.0))
        bench.sends = 0.0
        bench.clocks.reset_without(getattr(bench, still))
        bench.takes = 0.0
        bench.clocks.run(SETTLED)
        assert not bench.core.get()["shown"] and not bench.core.get()["lost"]
        bench.forget()
        bench.sends, bench.takes = 0.3, 1.0
        bench.pixel.period = bench.other.period = 1.0
        bench.clocks.run(100.0)
        drain(bench)
        assert bench.received == list(range(bench.sent)) and bench.sent > 10
