#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The table of MAC addresses: which datagrams it serves, and for how long they hold the output."""

from __future__ import annotations

import numpy as np
import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import If, Signal

from litestereo.gateware.link.address_table import AddressTable
from litestereo.sim.cores.stream_core import StreamCore
from support.pairs import generator

CLK_FREQ = 100_000
WAIT     = int(CLK_FREQ*AddressTable.WAIT_S)
REST     = AddressTable.REST

#: Station n is at the address n; its MAC address is n + move.
SILENT = 0x80 #: Stations from here on answer nothing.


class Segment(LiteXModule):
    """The table on a network: addresses of datagrams in, and for each whether it is dropped and its MAC address out.

    An address with bit 8 set is no datagram but a pause of that many times 16 clocks.
    """
    def __init__(self) -> None:
        self.sink   = stream.Endpoint([("address", 32)])
        self.source = stream.Endpoint([("mac_address", 31), ("failed", 1)])
        self.table  = table = AddressTable(CLK_FREQ)
        self.delay  = Signal(16) # Clocks until a station answers.
        self.move   = Signal(16) # What its MAC address differs by.
        self.held   = Signal(32) # Clocks for which datagrams have held the output.
        self.asked  = Signal(32) # Questions of the table.

        # # #

        waits, taken, count, station = Signal(), Signal(), Signal(16), Signal(32)
        pause = Signal(32)
        pausing = self.sink.valid & self.sink.address[8]
        self.comb += [
            table.request.valid.eq(self.sink.valid & ~self.sink.address[8] & ~taken),
            table.request.ip_address.eq(self.sink.address),
            self.source.valid.eq(taken & table.response.valid),
            self.source.failed.eq(table.response.failed),
            self.source.mac_address.eq(table.response.mac_address),
            table.response.ready.eq(taken & self.source.ready),
            self.sink.ready.eq((table.response.valid & table.response.ready)
                | (pausing & (pause == (self.sink.address[:8] << 4)))),
            table.source.ready.eq(1),
            table.sink.valid.eq(waits & (count == 0)),
            table.sink.reply.eq(1),
            table.sink.ip_address.eq(station),
            table.sink.mac_address.eq(station + self.move),
        ]
        self.sync += [
            If(table.request.valid & table.request.ready, taken.eq(1)),
            If(table.response.valid & table.response.ready, taken.eq(0)),
            If(self.sink.ready, pause.eq(0)).Elif(pausing, pause.eq(pause + 1)),
            If(self.sink.valid & ~self.sink.address[8], self.held.eq(self.held + 1)),
            If(count != 0, count.eq(count - 1)).Else(waits.eq(0)),
            If(table.source.valid & table.source.request,
                self.asked.eq(self.asked + 1),
                If(table.source.ip_address < SILENT,
                    waits.eq(1),
                    count.eq(self.delay),
                    station.eq(table.source.ip_address),
                ),
            ),
        ]


@pytest.fixture(scope="module")
def built():
    return StreamCore(Segment(), ["delay", "move"], status=["held", "asked"])


@pytest.fixture
def segment(built):
    built.reset()
    built.set(delay=10, move=0)
    return built


def pause(clocks: int) -> list[int]:
    """Items that let so many clocks pass, rounded up to a multiple of 16."""
    steps = -(-clocks//16)
    return [0x164]*(steps//100) + ([0x100 | steps % 100] if steps % 100 else [])


def send(segment: StreamCore, *addresses: int) -> list[int | None]:
    """Send datagrams, and pauses, in order; return the MAC address of each datagram, None if it was dropped."""
    wanted = sum(address < 0x100 for address in addresses)
    # One more than there are: the run ends after the last pause, when nothing has moved for longer than a wait.
    run    = segment.run(np.array(addresses, np.uint32), wanted + 1, idle_clocks=3*WAIT)
    assert run.accepted == len(addresses) and len(run.words) == wanted
    return [None if word >> 31 else int(word) for word in run.words[:, 0]]


def held(segment: StreamCore, *addresses: int) -> int:
    """Clocks for which datagrams hold the output."""
    before = segment.get("held")
    send(segment, *addresses)
    return segment.get("held") - before


def test_a_station_that_answers_gets_its_datagram(segment):
    assert send(segment, 1, 1, *pause(2*10*REST), 2, 1, 2) == [1, 1, 2, 1, 2]
    assert segment.get("asked") == 2


@pytest.mark.parametrize("delay", [0, 1, 2, WAIT//2, WAIT - 50])
def test_an_answer_in_time(segment, delay):
    segment.set(delay=delay)
    assert send(segment, 5, 5) == [5, 5]
    assert segment.get("asked") == 1


@pytest.mark.parametrize("delay", [WAIT + 50, 2*WAIT])
def test_a_late_answer_counts_for_the_next_datagram(segment, delay):
    segment.set(delay=delay)
    assert send(segment, 5, *pause(2*WAIT), 5) == [None, 5]
    assert segment.get("asked") == 1


def test_a_silent_station_is_dropped(segment):
    assert send(segment, SILENT, 1) == [None, None]
    # The first one held the output for the whole wait. The second one did not, and has its answer now.
    assert send(segment, *pause(100), 1) == [1]
    assert segment.get("asked") == 2


@pytest.mark.parametrize("period", [1, 3*WAIT//10, 7*WAIT, 30*WAIT, 40*WAIT])
def test_silent_stations_take_a_bounded_share_of_the_time(segment, period):
    """At any pace: at most 1/(REST + 1), and the peer of a session loses nothing."""
    rounds = max(4, 200*WAIT//period)
    send(segment, 1)
    addresses: list[int] = []
    for number in range(min(rounds, 2000)):
        addresses += [SILENT + number % 100, *pause(period), 1]
    strangers = sum(SILENT <= address < 0x100 for address in addresses)
    before    = segment.get("held")
    run       = segment.run(np.array(addresses, np.uint32), 2*strangers, idle_clocks=100*WAIT)
    words     = run.words[:, 0]
    assert (words[0::2] >> 31).all() and (words[1::2] == 1).all()
    spent = segment.get("held") - before
    # 30 clocks of each are the search, the question and the answer.
    assert spent - 30*2*strangers < run.clocks/(REST + 1) + WAIT


def test_stations_that_answer_late_take_no_more(segment):
    """The share counts waits that succeed, too."""
    segment.set(delay=WAIT - 50)
    addresses = [address for number in range(300) for address in (0x10 + number % 64, *pause(WAIT//2))]
    before    = segment.get("held")
    run       = segment.run(np.array(addresses, np.uint32), 300, idle_clocks=100*WAIT)
    assert segment.get("held") - before - 30*300 < run.clocks/(REST + 1) + WAIT


def test_a_known_station_is_asked_again_without_a_wait(segment):
    second = pause(CLK_FREQ)
    send(segment, 1)
    segment.set(delay=WAIT//2)
    assert held(segment, *second, 1, 1, *second, 1) < 3*20
    assert segment.get("asked") == 3


def test_a_station_that_falls_silent_stays_known(segment):
    second = pause(CLK_FREQ)
    send(segment, 1)
    # Its answers come too late for everything.
    segment.set(delay=50000)
    assert send(segment, *second, 1, *second, 1) == [1, 1]


def test_a_new_mac_address_replaces_the_old_one(segment):
    second = pause(CLK_FREQ)
    send(segment, 1, *pause(2*10*REST), 2)
    segment.set(move=0x100)
    assert send(segment, *second, 1, *pause(100), 1, 2, *pause(100), 1, 2) == [1, 0x101, 2, 0x101, 0x102]


@pytest.mark.parametrize("stations", [1, 2, 3, 4])
def test_as_many_as_there_are_entries_are_asked_once(segment, stations):
    rng   = generator(80 + stations)
    names = list(range(1, stations + 1))
    for name in names:
        send(segment, name)
    asked = segment.get("asked")
    order = [int(name) for name in rng.choice(names, 30)]
    assert send(segment, *order) == order
    assert segment.get("asked") - asked <= stations


def test_the_oldest_makes_room(segment):
    rest = pause(2*10*REST)
    for name in (1, 2, 3, 4, 5):
        assert send(segment, name, *rest) == [name]
    asked = segment.get("asked")
    assert send(segment, 2, 3, 4, 5) == [2, 3, 4, 5]
    assert segment.get("asked") == asked
    assert send(segment, 1) == [1]
    assert segment.get("asked") == asked + 1
