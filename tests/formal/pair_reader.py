#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""PairReader: a left and a right image from memory as pixel pairs."""

from __future__ import annotations

from migen import Array, Cat, If, Mux, Signal

from litestereo.gateware.memory.pair_reader import PairReader

from . import memory
from .proof import Proof, inside
from .streams import counted, held, sound, stays, stored, taken

BURST = 2


def pair_reader(make=PairReader) -> Proof:
    """Prove images of any size and address, pair after pair, aborted at any time; a bus that fails at any time."""
    bus    = memory.port()
    core   = make(bus, burst_bytes=BURST*memory.WORD)
    proof  = Proof(core)
    answer = memory.slave(proof, bus)
    memory.master(proof, bus, answer)
    proof.free(core.left_base, core.right_base, core.pixels, core.start, core.stop, core.source.ready)

    # How a frame is read: settings are stable from the clock before it on, and `stop` is held.
    begin = Signal()
    busy  = Signal()
    given = Signal()
    proof.comb += [begin.eq(core.start & core.idle), busy.eq(begin | ~core.idle)]
    proof.sync += [
        given.eq(given | (core.stop & ~core.idle)),
        If(core.idle,
            given.eq(0)
        ),
    ]
    bases = [core.left_base, core.right_base]
    proof.assume("settings hold", held(proof, bases[0], busy) & held(proof, bases[1], busy)
                 & held(proof, core.pixels, busy))
    proof.assume("a frame begins once its size is there", proof.started | ~core.start)
    proof.assume("bases are aligned",     (bases[0][:2] == 0) & (bases[1][:2] == 0))
    proof.assume("the size is legal",     (core.pixels != 0) & (core.pixels < 2**24))
    proof.assume("stop holds until idle", ~proof.past(core.stop & ~core.idle) | core.stop | core.idle)

    # Words of each image: a burst of the left one, the same burst of the right one, and so on.
    last_pixel = Signal(32)
    words      = Signal(32)
    right      = Signal()
    index      = Signal(30)
    proof.comb += [last_pixel.eq(core.pixels - 1), words.eq(last_pixel[2:] + 1)]
    request = bus.stb & answer
    counts  = [counted(proof, request & ~right, core.idle), counted(proof, request & right, core.idle)]
    count   = Signal(32)
    proof.comb += [
        count.eq(Mux(right, counts[1], counts[0])),
        index.eq(bus.adr - Mux(right, bases[1][2:], bases[0][2:])),
    ]
    burst_end = Signal()
    proof.comb += burst_end.eq((count[0] == BURST - 1) | (count == words - 1))
    proof.sync += [
        If(request & burst_end,
            right.eq(~right)
        ),
        If(core.idle,
            right.eq(0)
        ),
    ]
    proof.prove("addresses go from the bases up, each once, in bursts", ~bus.stb | (index == count))
    proof.prove("no address outside of [base, base + length)",          ~bus.stb | (index < words))
    proof.prove("only reads", ~bus.we)
    proof.prove("nothing is asked for outside of a frame", ~core.idle | ~bus.stb)

    # Pixels.
    moves = taken(core.source)
    pixel = counted(proof, moves, core.idle)
    ended = Signal()
    proof.comb += ended.eq(pixel == core.pixels)
    proof.prove("what is offered stays, or is given up", stays(proof, core.source) | given)
    proof.prove("no pixel outside of a frame",  ~core.source.valid | (~core.idle & (pixel < core.pixels)))
    proof.prove("the first pixel, and no other, is marked", ~core.source.valid | (core.source.first == (pixel == 0)))
    proof.prove("the last pixel, and no other, is marked",
                ~core.source.valid | (core.source.last == (pixel == core.pixels - 1)))
    proof.prove("a frame ends with all its pixels, or was given up",
                ~proof.started | ~core.idle | proof.past(core.idle | given | ended | core.stop))
    over = core.idle & proof.past(~core.idle)
    proof.reach("two frames end", counted(proof, over & ~given, 0, 4) == 2)
    proof.reach("one is given up", over & given & (pixel == 3))

    # One arbitrary word of one of the images.
    which, data, side = [proof.constant(bits) for bits in (32, 8*memory.WORD, 1)]
    proof.assume("the word holds the data", ~request | (right != side) | (count != which)
                 | ((bus.dat_r == data) & ~bus.err))
    shown = Mux(side, core.source.right, core.source.left)
    lanes = Array(data[8*n:8*(n + 1)] for n in range(memory.WORD))
    proof.prove("pixels are what memory holds, in order",
                ~core.source.valid | (pixel[2:] != which) | (shown == lanes[pixel[:2]]))
    invariants(proof, core, words, right, counts, count, pixel, given, ended, which, data, side)
    return proof


def invariants(proof: Proof, core: PairReader, words, right, counts, count, pixel, given, ended, which, data,
               side) -> None:
    """State the invariants of the registers, for the induction."""
    fsm      = core.fsm
    port     = core.reader.dma.fifo
    fifos    = [core.left_fifo, core.right_fifo]
    position = inside(core, "position")[0]
    own      = next(signal for signal in inside(core, "right") if len(signal) == 1)
    byte     = inside(core, "byte")[0]
    held_by  = inside(core, "held")
    state    = {name: fsm.state == value for name, value in fsm.encoding.items()}
    stopping = state["DRAIN"] | state["DRAIN-REQUEST"]
    reading  = ~core.idle & ~stopping
    still    = core.idle | state["DRAIN"] # Nothing is requested.
    before   = proof.past(right)
    ahead    = Signal(32)
    proof.comb += ahead.eq(counts[0] - counts[1])
    for fifo in [port, *fifos]:
        sound(proof, fifo)
    proof.prove("the states are six", fsm.state < 6)
    proof.prove("settings of the frame", core.idle | (inside(core, "last_word")[0] == words - 1))
    proof.prove("the side is known", still | (own == right))
    proof.prove("position counts", still | (position == count))
    proof.prove("the burst's first word",
                still | (inside(core, "burst_base")[0] == Mux(right, Cat(0, counts[1][1:]), counts[1])))
    proof.prove("left goes ahead by a burst at most", still | Mux(
        right,
        (ahead != 0) & (ahead <= BURST) & (counts[0] == Mux((counts[1] | 1) < words, (counts[1] | 1) + 1, words)),
        (counts[1][0] == 0) & (ahead <= 1) & (counts[1] <= counts[0])
        | (counts[0] == counts[1]) & (counts[0] == words)))
    proof.prove("no more than there is", core.idle | ((counts[0] <= words) & (counts[1] <= counts[0])))
    proof.prove("pixels when all is read", ~state["PIXELS"] | (counts[1] == words))
    proof.prove("more to read", ~(state["WAIT"] | state["BURST"] | state["DRAIN-REQUEST"]) | (counts[1] != words))
    proof.prove("a burst begins at its begin", ~state["WAIT"] | (count[0] == 0))
    proof.prove("given up", core.idle | ~stopping | given)
    proof.prove("given up stays", ~given | core.stop | core.idle)
    # Answers, a clock after the requests.
    answered = inside(core, "under_way")[0]
    proof.prove("an answer waits no longer than a clock", (port.level <= 1) & (answered == port.level))
    proof.prove("the answer's side", ~reading | (inside(core, "right_word")[0] == Mux(port.level == 1, before, right)))
    proof.prove("the answer's mark", ~reading | (port.level == 0) | (stored(proof, port, 0)[-1] == (before != right)))
    proof.prove("nothing is left over",
                ~core.idle | ((port.level == 0) & (fifos[0].level == 0) & (fifos[1].level == 0)))
    # Words of the images.
    out = Signal(32)
    proof.comb += out.eq(pixel[2:] + (ended & (pixel[:2] != 0)))
    for number, fifo in enumerate(fifos):
        coming = (port.level == 1) & (before == number)
        proof.prove(f"FIFO {number} holds the rest", ~reading | (counts[number] == out + fifo.level + coming))
        proof.prove(f"room of {number} is counted",      ~reading | (held_by[number] == fifo.level + coming))
        proof.prove(f"no more than {number} holds",  ~reading | (held_by[number] <= fifo.depth))
        proof.prove(f"a burst has room in {number}", ~state["BURST"] | (right != number)
                    | (held_by[number] + BURST - count[0] <= fifo.depth))
    proof.prove("pixels count", core.idle | ((inside(core, "remaining")[0] == core.pixels - pixel)
                                             & (pixel <= core.pixels)))
    proof.prove("the first is first", core.idle | (core.source.first == (pixel == 0)))
    proof.prove("a byte a pixel", core.idle | (byte == pixel[:2]))
    for number, fifo in enumerate(fifos):
        coming = (port.level == 1) & (before == number)
        waits  = (which >= out) & (which < out + fifo.level)
        proof.prove(f"FIFO {number} holds the word", ~reading | (side != number) | ~waits
                    | (stored(proof, fifo, which - out)[:32] == data))
        proof.prove(f"the answer of {number} holds the word", ~reading | (side != number) | ~coming
                    | (which != counts[number] - 1) | (stored(proof, port, 0)[:32] == data))
