#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Crossings between two clocks of any ratio: resets while one of the clocks is stopped."""

from __future__ import annotations

import pytest
from litex.gen import LiteXModule
from migen import ClockDomain, Signal

from litestereo.gateware.common.crossing import Crossing
from litestereo.gateware.common.pulse_crossing import PulseCrossing
from litestereo.sim.cores.pin_core import PinCore
from support.pairs import byte_generator
from support.two_clocks import Side, TwoClocks

MOST   = 5
ROUNDS = 120

#: Edges after which a side that did not see the reset has heard of it.
HEARD = 4


class Top(LiteXModule):
    """A crossing, with clock and reset of both sides as inputs."""
    def __init__(self, make) -> None:
        self.pins = {}
        for name in ("into", "out"):
            domain = ClockDomain(name)
            setattr(self, f"cd_{name}", domain)
            for pin, signal in (("clk", domain.clk), ("rst", domain.rst)):
                self.pins[f"{name}_{pin}"] = port = Signal()
                self.comb += signal.eq(port)
        self.crossing = make()


class Bench:
    """A core with two clocks; `edges` says what happens at an edge of each."""
    def __init__(self, make, inputs, outputs, rng, edges) -> None:
        top       = Top(make)
        self.core = PinCore(top, top.pins | {name: inputs(top.crossing)[name] for name in inputs(top.crossing)},
                            outputs(top.crossing))
        self.rng  = rng
        sides     = [Side(lambda act=act, name=name: self.edge(name, act),
                          lambda value, name=name: self.core.set(**{f"{name}_rst": value}))
                     for name, act in zip(("into", "out"), edges, strict=True)]
        self.into, self.out = sides
        self.clocks = TwoClocks(*sides, rng)

    def edge(self, name: str, act) -> None:
        act()
        self.core.set(**{f"{name}_clk": 1})
        self.core.set(**{f"{name}_clk": 0})

    def speaks(self, side: Side) -> bool:
        """Return whether the user of a side is at work."""
        return not side.resets and side.edges >= (0 if side.listens else HEARD)


CASES = pytest.mark.parametrize("still, listens", [("into", True), ("out", True), ("into", False), ("out", False)],
                                ids=["input", "output", "input that misses the reset", "output that misses the reset"])


@CASES
def test_words_after_a_reset(still, listens):
    """After a reset while one of the clocks was stopped, all words come out that went in, and no others."""
    rng  = byte_generator(70, still, str(listens))
    sent, taken, chance = [], [], {"into": 1.0, "out": 1.0}

    def into_edge() -> None:
        offers = bench.speaks(bench.into) and rng.random() < chance["into"]
        word   = len(sent) & 0xff
        bench.core.set(valid=int(offers), data=word)
        if offers and bench.core.get("ready"):
            sent.append(word)

    def out_edge() -> None:
        takes = bench.speaks(bench.out) and rng.random() < chance["out"]
        bench.core.set(take=int(takes))
        if takes and bench.core.get("shown"):
            taken.append(bench.core.get("word"))

    bench = Bench(lambda: Crossing([("data", 8)], "into", "out"),
                  lambda core: {"valid": core.sink.valid, "data": core.sink.data, "take": core.source.ready},
                  lambda core: {"ready": core.sink.ready, "shown": core.source.valid, "word": core.source.data},
                  rng, (into_edge, out_edge))
    for number in range(ROUNDS):
        bench.clocks.draw()
        chance.update(into=rng.choice([0.3, 1.0]), out=rng.choice([0.0, 0.3, 1.0]))
        side = getattr(bench, still)
        side.listens = listens
        bench.clocks.run(rng.uniform(0.0, 120.0))
        for one in (bench.into, bench.out):
            one.edges = -10**6 # Until the reset has ended.
        sent.clear()
        taken.clear()
        bench.clocks.reset_without(side)
        chance.update(into=1.0, out=1.0)
        bench.clocks.run(200.0)
        chance.update(into=0.0)
        bench.clocks.run(200.0)
        assert len(sent) > 20, number
        assert taken == sent, number
    bench.core.close()


@CASES
def test_pulses_after_a_reset(still, listens):
    """After such a reset as many pulses come out as came in since, and the first one may come at once."""
    rng  = byte_generator(71, still, str(listens))
    sent, came, chance = 0, 0, 1.0

    def into_edge() -> None:
        nonlocal sent
        pulse = bench.speaks(bench.into) and sent - came < MOST and rng.random() < chance
        bench.core.set(pulse=int(pulse))
        sent += pulse

    def out_edge() -> None:
        nonlocal came
        came += bench.speaks(bench.out) and bench.core.get("came")

    bench = Bench(lambda: PulseCrossing("into", "out", MOST), lambda core: {"pulse": core.i},
                  lambda core: {"came": core.o}, rng, (into_edge, out_edge))
    for number in range(ROUNDS):
        bench.clocks.draw()
        side = getattr(bench, still)
        side.listens = listens
        chance = rng.choice([0.1, 1.0])
        bench.clocks.run(rng.uniform(0.0, 60.0))
        for one in (bench.into, bench.out):
            one.edges = -10**6
        sent = came = 0
        bench.clocks.reset_without(side)
        chance = 1.0
        bench.clocks.run(100.0)
        chance = 0.0
        bench.clocks.run(100.0)
        assert sent > 5 and came == sent, number
    bench.core.close()
