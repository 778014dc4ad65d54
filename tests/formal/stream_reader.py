#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""StreamReader: a block of memory as a stream."""

from __future__ import annotations

from migen import Array, Signal

from litestereo.gateware.memory.stream_reader import StreamReader

from . import memory
from .proof import Proof, inside
from .streams import counted, held, sound, stays, stored, taken

ITEM  = 2
LANES = memory.WORD//ITEM


def stream_reader(make=StreamReader, most_bytes: int = 2**16 - 1, contents: bool = False) -> Proof:
    """Prove blocks of any length up to `most_bytes`, one after the other.

    With `contents` the bus never fails, and the items are compared with the memory.
    """
    bus    = memory.port()
    core   = make(bus, bits=8*ITEM, burst_bytes=8)
    proof  = Proof(core)
    answer = memory.slave(proof, bus)
    memory.master(proof, bus, answer)
    proof.free(core.base, core.length, core.start, core.source.ready)

    # Settings are stable during a block.
    begin = Signal()
    busy  = Signal()
    proof.comb += [begin.eq(core.start & core.idle), busy.eq(proof.past(begin) | ~core.idle)]
    proof.assume("base and length hold", held(proof, core.base, busy) & held(proof, core.length, busy))
    proof.assume("base is aligned",      core.base[:2] == 0)
    proof.assume("length is legal",      (core.length != 0) & (core.length <= most_bytes))

    # Numbers of the block, a bit wider than 16 so that nothing wraps.
    last_byte = Signal(17)
    words     = Signal(17)
    items     = Signal(17)
    proof.comb += [
        last_byte.eq(core.length - 1),
        words.eq(last_byte[2:] + 1),
        items.eq(last_byte[1:] + 1),
    ]
    asked = memory.in_order(proof, bus, answer, core.base, words, begin)
    moves = taken(core.source)
    item  = counted(proof, moves, begin, 17)

    proof.prove("what is offered stays",          stays(proof, core.source))
    proof.prove("the last item, and no other, is marked",
                ~core.source.valid | (core.source.last == (item == items - 1)))
    proof.prove("no item outside of a block",     ~core.source.valid | (~core.idle & (item < items)))
    proof.prove("no item before its word",        ~core.source.valid | (item[1:] < asked))
    proof.prove("with the last item all words were asked for", ~(moves & core.source.last) | (asked == words))
    proof.prove("a block ends with its last item",
                ~proof.started | ~core.idle | proof.past(core.idle | (moves & core.source.last)))
    proof.prove("nothing is asked for outside of a block", ~core.idle | ~bus.stb)
    proof.reach("two blocks end", counted(proof, moves & core.source.last, 0, 4) == 2)

    # Invariants of the registers, for the induction.
    position, asking = inside(core, "position")[0], inside(core, "asking")[0]
    own, lane        = inside(core, "item")[0], inside(core, "lane")[0]
    fifo             = core.reader.dma.fifo
    running          = ~core.idle
    proof.prove("position counts requests", core.idle | (position == asked[:16]))
    proof.prove("asking until the last",    ~asking | (running & (asked < words)))
    proof.prove("no longer than that",      core.idle | asking | (asked == words))
    proof.prove("item counts items",        core.idle | ((own == item[:16]) & (item < items) & (lane == item[0])))
    proof.prove("the FIFO holds the rest",  (asked[:16] == item[1:] + fifo.level) | core.idle)
    proof.prove("and nothing else",         running | (fifo.level == 0))
    sound(proof, fifo)
    if contents:
        # One arbitrary word of the block.
        which, data = proof.constant(16), proof.constant(8*memory.WORD)
        proof.assume("the bus never fails", ~bus.err)
        waits = (which >= item[1:]) & (which < asked)
        proof.prove("the FIFO holds it meanwhile",
                    ~running | ~waits | (stored(proof, fifo, which - item[1:])[:32] == data))
        proof.assume("the word holds the data", ~(bus.stb & bus.ack & (asked == which)) | (bus.dat_r == data))
        lanes = Array(data[8*ITEM*n:8*ITEM*(n + 1)] for n in range(LANES))
        proof.prove("items are what memory holds, in order",
                    ~core.source.valid | (item[1:] != which) | (core.source.data == lanes[item[0]]))
    return proof
