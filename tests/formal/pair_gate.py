#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""PairGate: each pixel pair of a frame passes once, in order, and no pair of another frame passes."""

from __future__ import annotations

from migen import If, Mux, Signal

from litestereo.gateware.link.pair_gate import PairGate

from .proof import Proof
from .streams import counted, feed, stays, taken


def pair_gate(make=PairGate) -> Proof:
    """Prove frames of any size, aborted at any time; chunks of any frame, length and offset, in any order."""
    core         = make()
    proof        = Proof(core)
    sink, source = core.sink, core.source
    chunk        = core.chunk
    feed(proof, sink)
    proof.free(source.ready, core.frame_id, core.pixels, core.open, core.close, chunk.frame_id, chunk.offset,
               chunk.length, chunk.judge, core.begin)
    proof.assume("a frame has pixels, and less than 2 GiB", (core.pixels != 0) & (core.pixels < 2**30))

    # How MessageSorter passes a chunk on: first judged and accepted, then as many words as its length says.
    words    = Signal(32)  # Words of the chunk that are not transferred yet.
    rounded  = Signal(32)
    holding  = [proof.past(field) == field for field in (chunk.frame_id, chunk.offset, chunk.length)]
    proof.comb += rounded.eq(chunk.length + 3)
    proof.assume("what is judged holds", ~(proof.past(chunk.judge) & chunk.judge)
                 | (holding[0] & holding[1] & holding[2]))
    proof.assume("a chunk passes when it fits", ~core.begin | (chunk.judge & chunk.judged & chunk.fits))
    proof.assume("and ends its being judged", ~proof.past(core.begin) | ~chunk.judge)
    proof.assume("one chunk at a time", ~chunk.judge | (words == 0))
    proof.assume("words are of the chunk", ~sink.valid | (words != 0))
    proof.assume("its last word is marked", sink.last == (words == 1))
    proof.sync += [
        If(taken(sink),
            words.eq(words - 1)
        ),
        If(core.begin,
            words.eq(rounded[2:])
        ),
    ]
    # Reference count of the frame.
    reopened = core.open | core.close
    pixels   = Signal(32)
    proof.sync += If(core.open, pixels.eq(core.pixels))
    passed   = counted(proof, taken(source), core.open)
    upper    = Signal() # The second pair of the word is next.
    proof.sync += [
        If(taken(source),
            upper.eq(~upper)
        ),
        If(taken(sink),
            upper.eq(0)
        ),
    ]
    proof.prove("what is offered stays, unless the frame is given up", proof.past(reopened) | stays(proof, source))
    proof.prove("a chunk that fits is not empty", ~(chunk.judge & chunk.judged & chunk.fits) | (chunk.length != 0))
    proof.prove("no pair beyond the frame", ~source.valid | (core.opened & (passed < pixels)))
    proof.prove("the first pair, and no other, is marked", ~source.valid | (source.first == (passed == 0)))
    proof.prove("so is the last", ~source.valid | (source.last == (passed == pixels - 1)))
    data = Mux(upper, sink.data[16:], sink.data[:16])
    proof.prove("a word is two pairs, the first in its low bits",
                ~source.valid | ((source.left == data[:8]) & (source.right == data[8:])))
    proof.prove("a word is taken with its second pair, or the frame's last", ~taken(sink) | ~source.valid
                | (taken(source) & (upper | source.last)))
    proof.prove("open until the last pair has passed", ~proof.started | ~proof.past(core.opened) | core.opened
                | proof.past(core.close) | proof.past(taken(source) & source.last))
    proof.reach("two frames pass", (counted(proof, taken(source) & source.last & (passed == 2), 0, 2) == 2))
    return proof
