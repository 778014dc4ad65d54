#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""FrameGuard: each frame that has begun gets exactly width x height pixels, in the right places, and then ends."""

from __future__ import annotations

from types import SimpleNamespace

from migen import If, Mux, Signal

from litestereo.gateware.cameras.frame_guard import DAMAGES, FrameGuard
from litestereo.gateware.cameras.layouts import FRAME_BEGIN, PIXEL, ROW_END
from litestereo.gateware.cameras.parameters import CameraParameters

from .proof import Proof, inside
from .streams import counted, feed, stays, taken

SMALL = CameraParameters(max_width=3, max_height=3, silence_bits=3)

#: Largest count of rows and pixels of the sensor that is told apart from more.
MANY = 7


def frame_guard(make=FrameGuard) -> Proof:
    """Prove frames of any size from a sensor that sends anything; their size may change between them."""
    core         = make(SMALL)
    proof        = Proof(core)
    sink, source = core.sink, core.source
    feed(proof, sink)
    proof.free(source.ready, core.accept, core.width, core.height)
    silence = proof.constant(len(core.silence))
    proof.comb += core.silence.eq(silence)
    proof.assume("the size is legal", (core.width != 0) & (core.width <= SMALL.max_width)
                 & (core.height != 0) & (core.height <= SMALL.max_height))
    size  = _size(proof, core)
    moves = taken(source)
    given = counted(proof, moves, core.begun, 5)
    begin = taken(sink) & (sink.kind == FRAME_BEGIN)
    proof.prove("what is offered stays", stays(proof, source))
    proof.prove("a frame begins with the sensor's, if it is accepted, and none is under way",
                core.begun == (begin & ~core.busy & core.accept))
    proof.prove("a frame of the sensor's that does not begin is dropped", core.dropped == (begin & ~core.begun))
    proof.prove("a frame is under way from its begin to its end", ~proof.started | (core.busy == (
        proof.past(core.begun) | (proof.past(core.busy) & ~proof.past(core.ended)))))
    proof.prove("pixels are of a frame", ~source.valid | core.busy)
    proof.prove("no pixel too many", ~source.valid | (given < size.total))
    proof.prove("no pixel too few", ~core.ended | (given == size.total))
    proof.prove("the first pixel, and no other, is marked", ~source.valid | (source.first == (given == 0)))
    proof.prove("so is the last", ~source.valid | (source.last == (given == size.total - 1)))
    state = {name: core.fsm.state == number for name, number in core.fsm.encoding.items()}
    sent  = _sensor(proof, core, moves, size)
    _silence(proof, core, silence)
    _flags(proof, core, sent, size)
    _invariants(proof, core, state, given, sent, size)
    return proof


def _size(proof: Proof, core: FrameGuard) -> SimpleNamespace:
    """Return the size of a frame, as it was at its begin."""
    size = SimpleNamespace(width=Signal(3), height=Signal(3), total=Signal(5))
    proof.sync += If(core.begun,
        size.width.eq(core.width),
        size.height.eq(core.height)
    )
    proof.comb += size.total.eq(_times(size.width, size.height))
    return size


def _times(width: Signal, number):
    """Return a width, at most 3, times a number."""
    return Mux(width[0], number, 0) + Mux(width[1], 2*number, 0)


def _sensor(proof: Proof, core: FrameGuard, moves, size: SimpleNamespace) -> SimpleNamespace:
    """Follow the sensor's frame: rows that have ended, pixels of the next one, whether one had a wrong number."""
    sink   = core.sink
    sent   = SimpleNamespace(rows=Signal(3), length=Signal(3), wrong=Signal())
    pixel  = taken(sink) & (sink.kind == PIXEL)
    ends   = taken(sink) & (sink.kind == ROW_END)
    proof.sync += [
        If(pixel & (sent.length != MANY),
            sent.length.eq(sent.length + 1)
        ),
        If(ends,
            sent.length.eq(0),
            If(sent.rows != MANY,
                sent.rows.eq(sent.rows + 1)
            ),
            # Rows after the last one may have any length.
            If((sent.rows < size.height) & (sent.length != size.width),
                sent.wrong.eq(1)
            )
        ),
        If(core.begun,
            sent.rows.eq(0),
            sent.length.eq(0),
            sent.wrong.eq(0)
        ),
    ]
    passes = moves & pixel & (core.source.pixel == sink.pixel) & (sent.length < size.width)
    proof.prove("a pixel of the sensor's comes out in its row and column, or the row or the frame is cut",
                ~pixel | ~core.busy | (sent.length >= size.width) | (sent.rows >= size.height)
                | (core.fsm.state == core.fsm.encoding["FILL"])
                | (passes & (core.row == sent.rows) & (core.column == sent.length)))
    proof.prove("any other pixel is 0", ~moves | pixel | (core.source.pixel == 0))
    return sent


def _silence(proof: Proof, core: FrameGuard, silence: Signal) -> None:
    """Prove that a frame ends for any behaviour of the sensor."""
    mark  = taken(core.sink) & (core.sink.kind != PIXEL)
    quiet = Signal(len(silence))
    still = Signal()
    proof.sync += If(mark | ~core.busy,
        quiet.eq(0)
    ).Elif((quiet != silence) & ~(core.source.valid & ~core.source.ready),
        quiet.eq(quiet + 1)
    )
    proof.comb += still.eq(core.busy & (quiet == silence))
    before = proof.past(still)
    proof.prove("after a silence a pixel is offered in one of two clocks, or the frame ends", ~before
                | ~proof.past(before) | core.source.valid | proof.past(core.source.valid) | core.ended | ~core.busy)
    proof.prove("a frame is stuck after a silence only", ~core.events["stuck"] | (quiet == silence))
    proof.prove("silence is counted", inside(core, "clocks")[0] == quiet)
    proof.prove("up to its limit", quiet <= silence)


def _flags(proof: Proof, core: FrameGuard, sent: SimpleNamespace, size: SimpleNamespace) -> None:
    """Prove that a frame without a flag is what the sensor has sent."""
    events = Signal(len(DAMAGES))
    proof.comb += [events[bit].eq(core.events[name]) for bit, name in enumerate(DAMAGES)]
    happened = Signal(len(DAMAGES))
    proof.sync += If(core.begun, happened.eq(0)).Elif(core.busy, happened.eq(happened | events))
    proof.prove("the flags are the events of the frame", core.flags == happened)
    whole = ~sent.wrong & (((sent.rows == size.height) & (sent.length == 0))
                           | ((sent.rows == size.height - 1) & (sent.length == size.width)))
    proof.prove("a frame without a flag is whole", ~core.ended | (core.flags != 0) | whole)
    proof.prove("no damage of no frame, apart from what is lost", core.busy | (events[:-1] == 0))
    for bit, name in enumerate(DAMAGES):
        proof.reach(f"a frame with {name} alone", core.ended & (core.flags == 1 << bit) & (size.total >= 4))
    proof.reach("a frame without a flag", core.ended & (core.flags == 0) & (size.total >= 4))


def _invariants(proof: Proof, core: FrameGuard, state: dict[str, Signal], given: Signal, sent: SimpleNamespace,
                size: SimpleNamespace) -> None:
    """Prove what the induction needs."""
    full  = inside(core, "given")[0]
    cut   = inside(core, "cut")[0]
    sound = core.flags == 0
    more  = state["ROWS"] | state["PAD"] | state["FILL"]
    done  = state["LAST"] | state["EXTRA"] | state["END"]
    proof.prove("seven states", core.fsm.state < 7)
    proof.prove("a frame is under way outside of IDLE", core.busy == (more | done))
    proof.prove("the size is the frame's", ~core.busy | (
        (core.columns == size.width - 1) & (core.rows == size.height - 1) & (size.width != 0) & (size.height != 0)
        & (size.width <= SMALL.max_width) & (size.height <= SMALL.max_height)))
    proof.prove("the place is that of the next pixel", ~more | (
        (given == _times(size.width, core.row) + core.column) & (core.row < size.height)
        & (core.column < size.width)))
    proof.prove("after the last one all have left", ~done | (given == size.total))
    proof.prove("a row that is full is not begun again",
                ~state["ROWS"] | ~full | ((core.column == 0) & (core.row != 0)))
    proof.prove("a row is cut when it is full", ~(state["ROWS"] | state["PAD"]) | ~cut | full)
    proof.prove("and has a flag", ~(state["ROWS"] | state["PAD"] | state["LAST"]) | ~cut
                | core.flags[DAMAGES.index("long_row")])
    proof.prove("a short row is not full", ~state["PAD"] | ~full)
    proof.prove("rows of the sensor are followed", ~(state["ROWS"] | state["PAD"])
                | ((sent.rows + full == core.row) & (full | state["PAD"] | (sent.length == core.column))
                   & (~full | ~sound | (sent.length == size.width))))
    proof.prove("the mark of a short row waits", ~state["PAD"] | (
        core.sink.valid & (core.sink.kind == ROW_END) & (sent.length < size.width) & ~sound))
    proof.prove("it waits on when the row is filled", ~((state["ROWS"] & full) | state["LAST"])
                | (sent.length >= size.width) | (core.sink.valid & (core.sink.kind == ROW_END) & ~sound))
    proof.prove("a filled frame has a flag, or gets one",
                ~state["FILL"] | ~sound | ((core.column == 0) & core.source.valid))
    proof.prove("the last row is under way", ~state["LAST"] | ((sent.rows == size.height - 1)
                & (~sound | (sent.length == size.width))))
    proof.prove("it has ended", ~state["EXTRA"] | ((sent.rows >= size.height)
                & (~sound | ((sent.rows == size.height) & (sent.length == 0)))))
    proof.prove("an extra row is told when it begins", ~state["EXTRA"] | ~full
                | core.flags[DAMAGES.index("extra_row")])
    proof.prove("so far the frame is whole", ~(state["ROWS"] | done) | ~sound | ~sent.wrong)
    proof.prove("at its end too", ~state["END"] | ~sound | (
        ((sent.rows == size.height) & (sent.length == 0))
        | ((sent.rows == size.height - 1) & (sent.length == size.width))))
