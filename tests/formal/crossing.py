#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Crossing and PulseCrossing: a stream, and pulses, between two clocks of any frequencies and phases."""

from __future__ import annotations

from functools import reduce
from operator import xor

from litex.gen import LiteXModule
from migen import Cat, If, Memory, Module, Signal
from migen.genlib.cdc import MultiReg

from litestereo.gateware.common.crossing import Crossing
from litestereo.gateware.common.pulse_crossing import PulseCrossing

from .proof import Proof
from .streams import queue, taken

DEPTH = 4
MOST  = 3  # Pulses in flight.


class OneClock(Module):
    """A core of two clock domains in one domain: the solver chooses the clocks in which each of the two advances.

    It can put an edge of one domain between any two edges of the other, so every order of edges is covered. A Gray
    pointer that changes while it is sampled is seen with its old or its new value: as if the edge came after the
    sample or before it.
    """

    def __init__(self, core: LiteXModule, **enables: Signal) -> None:
        fragment = core.get_fragment()
        self.regs: list[list[Signal]] = []
        synchronizers = [special for special in fragment.specials if isinstance(special, MultiReg)]
        for special in sorted(synchronizers, key=lambda one: one.duid):
            fragment.specials.remove(special)
            synchronizer = MultiReg.lower(special)
            self.regs.append(synchronizer.regs)
            fragment += synchronizer.get_fragment()
        for domain, enable in enables.items():
            fragment.sync[domain] = [If(enable, *fragment.sync[domain])]
        statements = [fragment.sync.pop(domain) for domain in enables]
        for domain in enables:
            for special in fragment.specials:
                special.rename_clock_domain(domain, "sys")
        fragment.sync["sys"] = [*fragment.sync.get("sys", []), *(one for each in statements for one in each)]
        self._fragment += fragment


def crossing(make=Crossing) -> Proof:
    """Prove a stream from one clock to another."""
    core          = make([("data", 2)], "into", "out", depth=DEPTH)
    sink, source  = core.sink, core.source
    into, out     = Signal(), Signal()
    whole         = OneClock(core, into=into, out=out)
    proof         = Proof(whole)
    offered, wish = Signal(), Signal()
    proof.free(into, out, offered, wish, sink.data, sink.last)
    # Each side samples and drives only at its edges.
    proof.comb += [sink.valid.eq(offered & into), source.ready.eq(wish & out)]

    item = Cat(sink.data, sink.last)
    shown = Cat(source.data, source.last)
    items, level = queue(proof, taken(sink), item, taken(source), DEPTH)
    shows = Signal(4)
    proof.sync += shows.eq(Cat(source.valid & ~taken(source), shown))
    proof.prove("what is offered stays", ~shows[0] | (source.valid & (shown == shows[1:])))
    proof.prove("it never overflows", level <= DEPTH)
    proof.prove("what it offers has come in, in order", ~source.valid | ((level != 0) & (shown == items[0])))
    proof.reach("it is full, then empty", (level == 0) & ended(proof, level == DEPTH))

    # Invariants of the registers, for the induction: each pointer follows the one ahead of it.
    produce, consume = [[counter for _, counter in core._submodules][n] for n in range(2)]
    chain = [pointer(proof, gray) for gray in
             (*reversed(whole.regs[1]), consume.q, *reversed(whole.regs[0]), produce.q)]
    way = Signal(8)
    proof.comb += way.eq(sum(distance(proof, behind, ahead) for behind, ahead in zip(chain, chain[1:], strict=False)))
    proof.prove("pointers are in order", way <= DEPTH)
    proof.prove("what is inside is between them", level == distance(proof, chain[2], chain[5]))
    for counter, binary in [(consume, chain[2]), (produce, chain[5])]:
        proof.prove(f"{'produce' if counter is produce else 'consume'} is the Gray code of its binary",
                    counter.q_binary == binary)
    memory = next(special for special in whole._fragment.specials if isinstance(special, Memory))
    for place in range(DEPTH):
        port    = memory.get_port(async_read=True)
        address = Signal(max=DEPTH)
        proof.specials += port
        proof.comb += [address.eq(chain[2] + place), port.adr.eq(address)]
        proof.prove(f"the memory holds item {place}", (place >= level) | (port.dat_r == items[place]))
    return proof


def pulse_crossing(make=PulseCrossing) -> Proof:
    """Prove pulses from one clock to another."""
    core            = make("into", "out", most=MOST)
    into, out, wish = Signal(), Signal(), Signal()
    whole           = OneClock(core, into=into, out=out)
    proof           = Proof(whole)
    level, waits    = Signal(max=MOST + 1), Signal(2)
    comes, goes     = Signal(), Signal()
    proof.free(into, out, wish)
    proof.comb += [core.i.eq(wish & into), comes.eq(wish & into), goes.eq(core.o & out)]
    proof.sync += [
        level.eq(level + comes - goes),
        If(goes | (level == 0), waits.eq(0)).Elif(out, waits.eq(waits + 1)),
    ]
    proof.assume("no more are under way than it is made for", ~comes | (level != MOST))
    proof.prove("a pulse comes out for one that came in", ~core.o | (level != 0))
    proof.prove("it comes out after two clocks of its side at most", waits <= 2)
    proof.reach("as many as can be are under way, then none", (level == 0) & ended(proof, level == MOST))

    # Invariants of the registers, for the induction.
    come, gone    = [counter for _, counter in core._submodules]
    first, second = whole.regs[0]
    chain         = [pointer(proof, gray) for gray in (gone.q, second, first, come.q)]
    way           = Signal(8)
    proof.comb += way.eq(sum(distance(proof, behind, ahead) for behind, ahead in zip(chain, chain[1:], strict=False)))
    proof.prove("counts are in order", way <= MOST)
    proof.prove("what is under way is between them", level == distance(proof, chain[0], chain[3]))
    proof.prove("a pulse that waited is in the first register", (waits == 0) | (first != gone.q))
    proof.prove("one that waited longer is in the second", (waits < 2) | (second != gone.q))
    for counter, binary in [(come, chain[3]), (gone, chain[0])]:
        proof.prove(f"{'come' if counter is come else 'gone'} is the Gray code of its binary",
                    counter.q_binary == binary)
    return proof


def pointer(proof: Proof, gray: Signal) -> Signal:
    """Return the binary number of a Gray code."""
    binary = Signal(len(gray))
    proof.comb += binary.eq(reduce(xor, (gray[bit:] for bit in range(len(gray)))))
    return binary


def distance(proof: Proof, behind: Signal, ahead: Signal) -> Signal:
    """Return how far one pointer is ahead of another."""
    difference = Signal(len(ahead))
    proof.comb += difference.eq(ahead - behind)
    return difference


def ended(proof: Proof, event) -> Signal:
    """Return a Signal that is 1 once `event` has happened."""
    been = Signal()
    proof.sync += If(event, been.eq(1))
    return been
