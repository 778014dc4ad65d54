#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Counters of events: none is lost at the highest rates, with software reading as often as it can, or after a reset."""

from __future__ import annotations

import re

import pytest
from migen import Signal

from litestereo.gateware.link.event_counters import COUNTER_NUMBERS, FREQUENT, EventCounters
from litestereo.gateware.peripherals.frame_link_csr import COUNTERS
from litestereo.sim.cores.pin_core import PinCore
from support.pairs import byte_generator
from support.paths import CHECKOUT

EVENTS = len(COUNTER_NUMBERS)

#: Clocks from one event to the next of its kind, and from one read to the next, at least.
APART    = [2 if n < FREQUENT else 8 for n in range(EVENTS)]
READ_GAP = 4

#: Clocks in which the counters are cleared, and in which all events are counted that have been gathered.
CLEARING, SETTLING = 16, 32


class Counters:
    """The core, beside the counts that it should have."""
    def __init__(self, seed: int) -> None:
        events      = [Signal(name=f"event{n}") for n in range(EVENTS)]
        dut         = EventCounters(events)
        pins        = {f"event{n}": event for n, event in enumerate(events)}
        self.core   = PinCore(dut, pins | {"index": dut.index, "read": dut.read}, {"value": dut.value})
        self.rng    = byte_generator(seed)
        self.counts = [0]*EVENTS

    def clock(self, events: set[int] = frozenset(), **pins: int) -> None:
        self.core.set(**{f"event{n}": int(n in events) for n in range(EVENTS)}, **pins)
        self.core.clock()
        self.core.set(read=0)
        for n in events:
            self.counts[n] += 1

    def idle(self, clocks: int) -> None:
        for _ in range(clocks):
            self.clock()

    def value(self, n: int) -> int:
        """Return a counter, in the second clock after its number was written."""
        self.clock(index=COUNTER_NUMBERS[n], read=1)
        value = self.core.get("value")
        self.idle(READ_GAP - 1)
        assert self.core.get("value") == value
        return value

    def run(self, clocks: int, rate: float, reads: float) -> None:
        """Let events come at a rate of 0 to 1 of the highest one, and read at random; a value never falls."""
        waits, wait, before = [self.rng.randrange(8) for _ in APART], 0, [0]*EVENTS
        for _ in range(clocks):
            events = {n for n in range(EVENTS) if not waits[n] and self.rng.random() < rate}
            waits  = [APART[n] - 1 if n in events else max(0, left - 1) for n, left in enumerate(waits)]
            if wait or self.rng.random() >= reads:
                wait = max(0, wait - 1)
                self.clock(events)
                continue
            n, known = self.rng.randrange(EVENTS), [*self.counts]
            self.clock(events, index=COUNTER_NUMBERS[n], read=1)
            value = self.core.get("value")
            assert max(before[n], known[n] - 4) <= value <= known[n]
            before[n], wait = value, READ_GAP - 1

    def check(self) -> None:
        self.idle(SETTLING)
        assert [self.value(n) for n in range(EVENTS)] == self.counts


@pytest.fixture
def counters(request):
    counters = Counters(getattr(request, "param", 0))
    counters.idle(CLEARING)
    yield counters
    counters.core.close()


@pytest.mark.parametrize("rate", [1.0, 0.8, 0.05])
@pytest.mark.parametrize("reads", [0.0, 0.3, 1.0])
def test_no_event_is_lost(counters, rate, reads):
    counters.run(3000, rate, reads)
    counters.check()


def test_all_at_once(counters):
    """Events of all kinds in one clock, in each clock of the round."""
    for wait in range(16, 33):
        counters.clock(set(range(EVENTS)))
        counters.idle(wait)
    counters.check()


def test_a_carry_into_every_bit(counters):
    """Counts of more than 8 bits, one beside others that stay."""
    for _ in range(700):
        counters.clock({0, 9} if counters.counts[0] % 4 == 0 else {0})
        counters.clock()
    counters.check()
    assert counters.counts[0] == 700 and counters.counts[1] == 0


def test_cleared_by_a_reset(counters):
    """In any clock; events while the counters are cleared are counted."""
    for phase in range(20):
        counters.run(100 + phase, 1.0, 0.5)
        counters.core.reset()
        counters.counts = [0]*EVENTS
        counters.clock(set(range(EVENTS)))
        counters.idle(CLEARING)
        counters.check()


def test_the_driver_has_their_numbers():
    """The firmware's driver counts its constants as the gateware numbers the counters."""
    source  = (CHECKOUT / "firmware/drivers/frame_link.c").read_text()
    (names,) = re.findall(r"enum \{  /\* Values of counter_index\. \*/\n(.*?)\};", source, re.DOTALL)
    numbers, following = {}, 0
    for name, number in re.findall(r"(\w+)(?:\s*= (\d+))?,", names):
        following = int(number) if number else following
        numbers[name.lower()] = following
        following += 1
    assert numbers == dict(zip(COUNTERS, COUNTER_NUMBERS, strict=True))
