#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Crossing and PulseCrossing: a stream, and pulses, between two clocks of any frequencies and phases."""

from __future__ import annotations

from functools import reduce
from operator import xor
from types import SimpleNamespace

from litex.gen import LiteXModule
from migen import C, Cat, If, Memory, Module, Signal
from migen.fhdl.tools import list_targets
from migen.genlib.cdc import MultiReg

from litestereo.gateware.common.crossing import Crossing
from litestereo.gateware.common.pulse_crossing import PulseCrossing

from .proof import Proof, inside
from .streams import queue, taken

DEPTH = 4
MOST  = 3  # Pulses in flight.
SIDES = ("into", "out")

#: A `CrossingReset` that has nothing to do.
NEVER = SimpleNamespace(blocked=dict.fromkeys(SIDES, C(0)), clear=dict.fromkeys(SIDES, C(0)))


class OneClock(Module):
    """A core of two clock domains in one domain: the solver chooses the clocks in which each of the two advances.

    It can put an edge of one domain between any two edges of the other, so every order of edges is covered. A Gray
    pointer that changes while it is sampled is seen with its old or its new value: as if the edge came after the
    sample or before it.

    `resets` are the resets of the domains, which are effective at their edges.
    """

    def __init__(self, core: LiteXModule, resets: dict[str, Signal] | None = None, **enables: Signal) -> None:
        fragment = core.get_fragment()
        self.regs: list[list[Signal]] = []
        synchronizers = [special for special in fragment.specials if isinstance(special, MultiReg)]
        for special in sorted(synchronizers, key=lambda one: one.duid):
            fragment.specials.remove(special)
            synchronizer = MultiReg.lower(special)
            self.regs.append(synchronizer.regs)
            fragment += synchronizer.get_fragment()
        for domain, reset in (resets or {}).items():
            targets = sorted(list_targets(fragment.sync[domain]), key=lambda one: one.duid)
            fragment.sync[domain] = [*fragment.sync[domain], If(reset, *(
                target.eq(target.reset) for target in targets if not target.reset_less))]
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
    core          = make([("data", 2)], "into", "out", depth=DEPTH, reset=NEVER)
    sink, source  = core.sink, core.source
    into, out     = (Signal(name_override=f"edge_{side}") for side in SIDES)
    whole         = OneClock(core, into=into, out=out)
    proof         = Proof(whole)
    offered, wish = (Signal(name_override=name) for name in ("offered", "wish"))
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
    core            = make("into", "out", most=MOST, reset=NEVER)
    into, out, wish = (Signal(name_override=name) for name in ("edge_into", "edge_out", "wish"))
    whole           = OneClock(core, into=into, out=out)
    proof           = Proof(whole)
    level           = Signal(max=MOST + 1)
    waits           = Signal(2)
    comes, goes     = (Signal(name_override=name) for name in ("comes", "goes"))
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
    proof.prove("no pulse waits for a reset", inside(core, "waiting")[0] == 0)
    for counter, binary in [(come, chain[3]), (gone, chain[0])]:
        proof.prove(f"{'come' if counter is come else 'gone'} is the Gray code of its binary",
                    counter.q_binary == binary)
    return proof


def crossing_reset(make=Crossing) -> Proof:
    """Prove a stream across resets of either side, at any time, for any number of its clocks, none included."""
    core         = make([("data", 1)], "into", "out", depth=DEPTH)
    sink, source = core.sink, core.source
    edges        = [Signal(name_override=f"edge_{side}")  for side in SIDES]
    rests        = [Signal(name_override=f"reset_{side}") for side in SIDES]
    into, out    = edges
    offered, wish = (Signal(name_override=name) for name in ("offered", "wish"))
    proof        = Proof(OneClock(core, dict(zip(SIDES, rests, strict=True)), into=into, out=out))
    proof.free(*edges, *rests, offered, wish, sink.data)
    proof.comb += [sink.valid.eq(offered & into & ~rests[0]), source.ready.eq(wish & out & ~rests[1])]

    # What is inside: emptied when the side that fills it clears its pointer, which it does after a reset alone.
    clears = [core.reset.clear[side] & edge for side, edge in zip(SIDES, edges, strict=True)]
    items  = [Signal(name_override=f"item_{place}") for place in range(DEPTH)]
    level  = Signal(4)
    comes  = taken(sink)
    goes   = taken(source)
    after  = Signal(4)
    proof.comb += after.eq(level - goes)
    proof.sync += [
        level.eq(after + comes),
        If(goes, [item.eq(following) for item, following in zip(items, items[1:], strict=False)]),
        [If(comes & (after == place), item.eq(sink.data)) for place, item in enumerate(items)],
        If(clears[0], level.eq(0)),
    ]
    proof.prove("it never overflows", level <= DEPTH)
    proof.prove("what it offers has come in since a reset, in order", ~source.valid | ((level != 0)
                & (source.data == items[0])))
    blocked = [core.reset.blocked[side] for side in SIDES]
    proof.prove("the output clears while the input accepts nothing", ~clears[1] | ~proof.past(~blocked[0]) | blocked[0]
                | (inside(core, "consumed")[0] == 0))
    proof.prove("the input clears while the output shows nothing", ~clears[0] | ~source.valid)
    proof.prove("it accepts nothing while a reset is under way", ~blocked[0] | ~sink.ready)
    # Since both sides were free and had nothing left to do: whether one of them was reset again.
    done  = Signal()
    again = Signal()
    state = Cat(*(signal for name in ("wanted", "asks", "asked", "answered", "answers")
                  for side in SIDES for signal in inside(core, f"{name}_{side}")), *blocked)
    proof.sync += [
        If(done, again.eq(0)),
        If((into & rests[0]) | (out & rests[1]), again.eq(1)),
    ]
    proof.comb += done.eq(state == 0)
    proof.prove("it is emptied after a reset alone", ~proof.past(done) | proof.past(into & rests[0])
                | proof.past(out & rests[1]) | done)
    waits = Signal(3)
    proof.sync += If((level == 0) | source.valid | ~done, waits.eq(0)).Elif(out & (waits != 7), waits.eq(waits + 1))
    proof.prove("what came in comes out", waits <= 2)
    # Clocks without a reset in which both sides advance.
    calm = Signal(5)
    proof.sync += If(rests[0] | rests[1], calm.eq(0)).Elif(into & out & (calm != 31), calm.eq(calm + 1))
    proof.prove("it works again soon after", (calm < 24) | done)
    been = ended(proof, level == DEPTH)
    proof.reach("it is full, emptied by a reset, and works again", been & done & again & (level == 0))
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
