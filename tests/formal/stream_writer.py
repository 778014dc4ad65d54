#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""StreamWriter: a stream into a block of memory."""

from __future__ import annotations

from migen import Array, If, Signal

from litestereo.gateware.memory.stream_writer import StreamWriter

from . import memory
from .proof import Proof, inside
from .streams import counted, feed, held, sound, stored, taken

ITEM  = 2
LANES = memory.WORD//ITEM


def stream_writer(make=StreamWriter, burst_words: int = 2) -> Proof:
    """Prove blocks of any length, one after the other, aborted at any time; a bus that fails at any time."""
    bus    = memory.port()
    core   = make(bus, bits=8*ITEM, burst_bytes=burst_words*memory.WORD)
    proof  = Proof(core)
    answer = memory.slave(proof, bus)
    memory.master(proof, bus, answer)
    feed(proof, core.sink)
    proof.free(core.base, core.start, core.stop)

    # How a block is written: the base is stable, `stop` is held, and nothing follows the last item.
    begin = Signal()
    busy  = Signal()
    ended = Signal()
    given = Signal()
    proof.comb += [begin.eq(core.start & core.idle), busy.eq(proof.past(begin) | ~core.idle)]
    moves = taken(core.sink)
    proof.sync += [
        If(moves & core.sink.last,
            ended.eq(1)
        ),
        given.eq(given | (core.stop & ~core.idle)),
        If(begin,
            ended.eq(0),
            given.eq(0)
        ),
    ]
    proof.assume("the base holds",           held(proof, core.base, busy))
    proof.assume("the base is aligned",      core.base[:2] == 0)
    proof.assume("stop holds until idle",    ~proof.past(core.stop & ~core.idle) | core.stop | core.idle)
    proof.assume("nothing comes after last",  ~core.sink.valid | ~ended)

    # Items, and the words that they make; a block that the solver chooses, shorter than 2**30 bytes.
    item  = counted(proof, moves, begin)
    words = Signal(32)
    proof.comb += words.eq(item[1:] + (ended & item[0]))
    proof.assume("the block is not endless", item < 2**29)
    count = Signal(30)
    proof.comb += count.eq(memory.in_order(proof, bus, answer, core.base, words, begin, bits=30))
    proof.prove("only writes", ~bus.stb | bus.we)
    proof.prove("items are taken in a block alone", ~moves | ~core.idle)
    over = Signal()
    proof.comb += over.eq(core.idle & proof.past(~core.idle))
    proof.prove("a block ends with all its words written, or was given up", ~over | given | (ended & (count == words)))
    proof.prove("nothing is written outside of a block", ~core.idle | ~bus.stb)
    proof.reach("two blocks end", counted(proof, over & ~given, 0, 4) == 2)
    proof.reach("one is given up", over & given & ~ended & (count == 3))

    # One arbitrary item of the block.
    which, data = [proof.constant(bits) for bits in (32, 8*ITEM)]
    proof.assume("the item holds the data", ~moves | (item != which) | (core.sink.data == data))
    def lane_of(word):
        return Array(word[8*ITEM*n:8*ITEM*(n + 1)] for n in range(LANES))[which[0]]
    proof.prove("memory gets the items, in order", ~bus.stb | (item <= which) | (count != which[1:])
                | (lane_of(bus.dat_w) == data))

    # Invariants of the registers, for the induction.
    fifo, fsm = core.fifo, core.fsm
    named     = {name: inside(core, name)[0] for name in
                 ("running", "position", "under_way", "packed", "full", "word", "lane", "last_word")}
    running   = named["running"]
    pushed    = Signal(31)
    proof.comb += pushed.eq(count + fifo.level)
    sound(proof, fifo)
    proof.prove("running in two states",    running == ((fsm.state == fsm.encoding["COLLECT"])
                                                        | (fsm.state == fsm.encoding["BURST"])))
    proof.prove("the states are five",      fsm.state < 5)
    proof.prove("written when taken",       named["under_way"] == 0)
    proof.prove("position counts requests", core.idle | (named["position"] == count))
    proof.prove("stopped if ever",          ~given | core.stop | core.idle)
    proof.prove("drained when given up or over", core.idle | running | given | (ended & (count == words))
                | (fsm.state == fsm.encoding["DRAIN-REQUEST"]))
    proof.prove("a late request",           (fsm.state != fsm.encoding["DRAIN-REQUEST"]) | (given & (fifo.level != 0)))
    proof.prove("nothing is left over",     ~core.idle | ((fifo.level == 0) & ~named["full"] & (named["lane"] == 0)))
    proof.prove("a word is made of items",  ~running | (pushed + named["full"] == words))
    proof.prove("no more than there is",    core.idle | (pushed + named["full"] <= words))
    proof.prove("the lane is the item's",   ~running | (named["lane"] == (item[0] & ~ended)))
    proof.prove("a full word is left alone", ~named["full"] | (named["lane"] == 0))
    proof.prove("packed with the last word", ~running | (named["packed"] == (ended & ~named["full"])))
    proof.prove("the last word waits",      ~running | ~named["full"] | (named["last_word"] == ended))
    waits = (which[1:] >= count) & (which[1:] < pushed) & (fifo.level != 0)
    in_fifo = stored(proof, fifo, which[1:] - count)
    proof.prove("the FIFO holds the item",  ~running | ~waits | (item <= which)
                | (lane_of(in_fifo[:32]) == data))
    for place in range(fifo.depth):
        mark = stored(proof, fifo, place)[-1]
        proof.prove(f"the FIFO's place {place} holds the mark", ~running | (place >= fifo.level)
                    | (mark == (ended & ~named["full"] & (place == fifo.level - 1))))
    proof.prove("the word holds the item",  ~running | (item <= which) | (which[1:] != pushed)
                | (lane_of(named["word"]) == data))
    return proof
