#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""TriggerGenerator and PairMatcher: each clock as their definitions say, for settings at and around each limit."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from litestereo.gateware.cameras.pair_matcher import PairMatcher
from litestereo.gateware.cameras.trigger_generator import TriggerGenerator
from support.packed_core import PackedCore
from support.pairs import byte_generator

LONGEST = 2**32 - 1

# Triggers ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def triggers():
    """Return the generator in Verilator."""
    module = TriggerGenerator()
    core   = PackedCore(module, {name: getattr(module, name) for name in ("enable", "period", "width")},
                        {name: getattr(module, name) for name in ("trigger", "started", "now", "stamp", "number")})
    yield core
    core.close()


class Triggers:
    """The generator by its definition: a trigger starts two clocks after it is due."""

    def __init__(self) -> None:
        self.now     = 0
        self.begins: list[tuple[int, int]] = []  #: first clock and width of each trigger
        self.due     = -LONGEST                  #: clock in which the newest trigger started

    def expect(self) -> dict[str, int]:
        """Return the outputs of this clock."""
        begun = [(first, width) for first, width in self.begins[-3:] if first <= self.now]
        # A trigger that starts replaces what is under way.
        high  = bool(begun) and self.now < sum(begun[-1])
        count = sum(first <= self.now for first, _ in self.begins)
        return {"now": self.now, "trigger": int(high), "started": int(bool(begun) and begun[-1][0] == self.now),
                "stamp": begun[-1][0] if begun else 0, "number": count}

    def clock(self, enable: int, period: int, width: int) -> None:
        """Go on to the next clock."""
        if enable and self.now - self.due >= max(period, 1):
            self.due = self.now
            self.begins.append((self.now + 2, width))
        self.now += 1


def run(core: PackedCore, model: Triggers, clocks: int, **settings: int) -> None:
    """Compare some clocks with the model."""
    core.set(**settings)
    for _ in range(clocks):
        assert core.get() == model.expect()
        model.clock(**{name: core.input(name) for name in ("enable", "period", "width")})
        core.clock()


@pytest.mark.parametrize("period", [0, 1, 2, 3, 7, 8, 100, LONGEST])
@pytest.mark.parametrize("width", [0, 1, 2, 6, 7, 8, 99, 100, 101, LONGEST])
def test_periods_and_widths(triggers, period, width):
    """Triggers come at the period, with the width, or stay as they are at its limits."""
    triggers.set(enable=0)
    triggers.reset()
    model = Triggers()
    run(triggers, model, 5, enable=0, period=period, width=width)
    run(triggers, model, 250, enable=1)
    run(triggers, model, 120, enable=0)
    assert len(model.begins) == (1 if period == LONGEST else -(-250//max(period, 1)))


def test_drawn_triggers(triggers):
    """Settings that change at any time, and resets, leave number, stamps and pulses right."""
    rng = byte_generator(440)
    for _ in range(30):
        triggers.reset()
        model = Triggers()
        for _ in range(8):
            run(triggers, model, rng.randrange(1, 40), enable=int(rng.random() < 0.8),
                period=rng.choice((0, 1, 2, 5, 20)), width=rng.choice((0, 1, 3, 30)))


# Pairs ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pairs():
    """Return the matcher of pairs in Verilator."""
    module = PairMatcher()
    inputs = {name: getattr(module, name) for name in ("now", "number", "exposure", "free_running", "window",
                                                       "flag_limit", "drop_limit")}
    inputs |= {"left": module.starts[0], "right": module.starts[1]}
    outputs = {name: getattr(module, name) for name in ("paired", "dropped", "flagged", "skew", "pair_number",
                                                        "exposed")}
    outputs |= {"left_alone": module.alone[0], "right_alone": module.alone[1], "left_stamp": module.stamps[0],
                "right_stamp": module.stamps[1]}
    core = PackedCore(module, inputs, outputs)
    yield core
    core.close()


@dataclass
class Pairs:
    """What happens to starts, by definition; a report is of the clock after its event."""
    window:  int
    flag:    int
    drop:    int
    free:    int = 0
    waiting: tuple[int, int, int, int] | None = None #: side, clock, number, exposure
    counted: int = 0
    held:    dict[str, int] = field(default_factory=dict) #: the newest report

    def clock(self, now: int, starts: tuple[int, int], number: int, exposure: int) -> dict[str, int]:
        """Return the pulses of the next clock."""
        pulses = {"paired": 0, "dropped": 0, "left_alone": 0, "right_alone": 0}
        alone  = ("left_alone", "right_alone")
        other  = self.waiting and starts[1 - self.waiting[0]] and not all(starts)
        if any(starts) and not other:
            if self.waiting:
                pulses[alone[self.waiting[0]]] = 1
                self.waiting = None
            self.counted += 1
            begun = (self.counted, 0) if self.free else (number, exposure)
            if all(starts):
                self.report(pulses, (now, now), *begun)
            elif self.window:
                self.waiting = (starts.index(1), now, *begun)
            else:
                pulses[alone[starts.index(1)]] = 1
        elif other:
            side, clock, *begun = self.waiting
            self.waiting = None
            self.report(pulses, (clock, now) if side == 0 else (now, clock), *begun)
        elif self.waiting and now - self.waiting[1] >= self.window:
            pulses[alone[self.waiting[0]]] = 1
            self.waiting = None
        return pulses

    def report(self, pulses: dict[str, int], stamps: tuple[int, int], number: int, exposure: int) -> None:
        """Report a pair."""
        skew = stamps[1] - stamps[0]
        pulses["dropped" if abs(skew) > self.drop else "paired"] = 1
        self.held = {"flagged": int(abs(skew) > self.flag), "skew": skew % 2**32, "pair_number": number,
                     "exposed": exposure, "left_stamp": stamps[0], "right_stamp": stamps[1]}


def follow(core: PackedCore, model: Pairs, starts, rng, clock: int = 2**40, reset: bool = True) -> dict[str, int]:
    """Compare clocks with the model; return how often each pulse came."""
    core.set(window=model.window, flag_limit=model.flag, drop_limit=model.drop, free_running=model.free)
    core.set(left=0, right=0)
    if reset:
        core.reset()
    counts = dict.fromkeys(("paired", "dropped", "left_alone", "right_alone"), 0)
    pulses = dict(counts)
    number = rng.getrandbits(32)
    for left, right in starts:
        out = core.get()
        assert {name: out[name] for name in pulses} == pulses
        assert {name: out[name] for name in model.held} == model.held
        number   = (number + (rng.random() < 0.1)) % 2**32
        exposure = rng.getrandbits(64)
        core.set(now=clock, left=left, right=right, number=number, exposure=exposure)
        pulses = model.clock(clock, (int(left), int(right)), number, exposure)
        counts = {name: count + pulses[name] for name, count in counts.items()}
        clock += 1
        core.clock()
    return counts


@pytest.mark.parametrize("free", [0, 1])
@pytest.mark.parametrize("window", [0, 1, 2, 7, 40, 2**31 - 1])
def test_drawn_starts(pairs, window, free):
    """Starts at any time: pairs, flags, drops, frames that are alone, and their order."""
    rng = byte_generator(441, window, free)
    for _ in range(12):
        likely = rng.choice((0.02, 0.1, 0.5))
        limits = sorted(rng.choice((0, 1, window//2, window, 5)) for _ in range(2))
        model  = Pairs(window, *limits, free)
        starts = [(rng.random() < likely, rng.random() < likely) for _ in range(400)]
        follow(pairs, model, starts, rng)


@pytest.mark.parametrize("skew", [-31, -30, -11, -10, -6, -5, -1, 0, 1, 5, 6, 10, 11, 30, 31])
def test_limits(pairs, skew):
    """At each limit a pair is still good; a clock above it is flagged, dropped, or none at all."""
    rng    = byte_generator(442, skew)
    model  = Pairs(window=30, flag=5, drop=10)
    starts = [(clock % 61 == max(-skew, 0), clock % 61 == max(skew, 0)) for clock in range(61*10)]
    counts = follow(pairs, model, starts, rng)
    kind   = "none" if abs(skew) > 30 else "dropped" if abs(skew) > 10 else "paired"
    # With a skew of more than half a period the next one is nearer: 61 - 31 is 30.
    assert counts["paired"] == (10 if kind == "paired" else 0)
    assert counts["dropped"] == (10 if kind == "dropped" else 9 if kind == "none" else 0)
    assert model.held["flagged"] == (abs(skew) > 5)


def test_one_sensor_alone(pairs):
    """Each frame of a sensor without its partner is told, and counted in the mode without triggers."""
    rng    = byte_generator(443)
    model  = Pairs(8, 2, 4, free=1)
    counts = follow(pairs, model, [(clock % 20 == 0, clock >= 200 and clock % 20 == 0) for clock in range(300)], rng)
    assert counts == {"paired": 5, "dropped": 0, "left_alone": 10, "right_alone": 0}
    assert model.held["pair_number"] == 15


def test_reset_while_a_start_waits(pairs):
    """It is forgotten."""
    rng = byte_generator(444)
    follow(pairs, Pairs(30, 5, 10), [(1, 0), (0, 0)], rng)
    counts = follow(pairs, Pairs(30, 5, 10), [(0, 1), *[(0, 0)]*40], rng)
    assert counts == {"paired": 0, "dropped": 0, "left_alone": 0, "right_alone": 1}
