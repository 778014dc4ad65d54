#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Cores that pass items on unchanged: the registers between two streams, and the arbiter of messages."""

from __future__ import annotations

from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import If, Mux, Signal

from litestereo.gateware.common.stream_register import add_register
from litestereo.gateware.link.message_arbiter import MessageArbiter

from .proof import Proof, inside, smaller
from .streams import all_of, counted, feed, queue, stays, taken


class Joined(LiteXModule):
    """Two streams with registers between them."""

    def __init__(self, join) -> None:
        self.sink   = stream.Endpoint([("data", 4)])
        self.source = stream.Endpoint([("data", 4)])
        join(self, self.sink, self.source)


def register(join=add_register) -> Proof:
    """Prove that two items fit into the registers for data and for ready."""
    core  = Joined(join)
    proof = Proof(core)
    feed(proof, core.sink)
    proof.free(core.source.ready)
    items, level = queue(proof, taken(core.sink), all_of(core.sink), taken(core.source), 2)
    proof.prove("what is offered stays", stays(proof, core.source))
    proof.prove("not more than two items are inside", level <= 2)
    proof.prove("items come out as they went in, in order", ~core.source.valid | (level == 0)
                | (all_of(core.source) == items[0]))
    proof.prove("none comes twice, none from nowhere", core.source.valid == (level != 0))
    proof.prove("it takes an item unless both registers are full", core.sink.ready == (level < 2))
    proof.reach("both are full, then empty", proof.past(proof.past(level == 2)) & (level == 0))
    # Invariants, for the induction: which item is in which register.
    behind, ahead = core._submodules[0][1], core._submodules[1][1]
    proof.prove("the register for data has the first", ~ahead.source.valid | (all_of(ahead.source) == items[0]))
    proof.prove("nothing waits without being valid", core.sink.ready | behind.source.valid)
    proof.prove("that for ready the second", core.sink.ready | (all_of(behind.source) == items[1]))
    return proof


def arbiter(make=MessageArbiter) -> Proof:
    """Prove two sources of messages, and a receiver that accepts words and messages at any time."""
    core  = smaller(make, job_layout=lambda: [("offset", 2)])()
    proof = Proof(core)
    for sink in [*core.sinks, *core.payloads]:
        feed(proof, sink)
    proof.free(core.source.ready, core.payload.ready)
    held  = core.taken
    moves = [taken(sink) for sink in core.sinks]
    turn  = inside(core, "turn")[0]
    before, sent = proof.past(held), proof.past(taken(core.source))
    for what, source, sinks in [("messages", core.source, core.sinks), ("words", core.payload, core.payloads)]:
        count = Signal(2)
        proof.comb += count.eq(taken(sinks[0]) + taken(sinks[1]))
        # After the last word of a message the first word of the next may be offered: it waits for its message.
        proof.prove(f"{what}: what is offered stays, to the message's end", sent | stays(proof, source))
        proof.prove(f"{what}: each is taken and given in one clock", count == taken(source))
        for n, sink in enumerate(sinks):
            proof.prove(f"{what}: those of sink {n} pass unchanged, in its message alone",
                        Mux(held[n], (source.valid == sink.valid) & (all_of(source) == all_of(sink)), ~taken(sink)))
    proof.prove("one message at a time", held != 3)
    proof.prove("a message is taken to its end", ~proof.started | (before == 0) | sent | (held == before))
    proof.prove("after its end there is a clock without", ~sent | (held == 0))
    for n in range(2):
        overtaken = Signal(2)
        proof.sync += [
            If(moves[1 - n] & core.sinks[n].valid,
                overtaken.eq(overtaken + 1)
            ),
            If(moves[n],
                overtaken.eq(0)
            ),
        ]
        proof.prove(f"sink {n} waits for one message of the other at most", overtaken <= 1)
        # Invariants, for the induction.
        proof.prove(f"then sink {n} has its turn", (overtaken == 0)
                    | (core.sinks[n].valid & (held[n] | ((held == 0) & (turn == 1 - n)))))
    for n in range(2):
        proof.prove(f"the message of sink {n} that has its turn is there", ~held[n] | core.sinks[n].valid)
    proof.reach("two messages of each", (counted(proof, moves[0], 0, 3) == 2) & (counted(proof, moves[1], 0, 3) == 2))
    return proof
