#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""PairJoin: what leaves are pairs, each whole, of frames of the newest starts, or given up; and nothing else."""

from __future__ import annotations

from types import SimpleNamespace

from migen import Array, Cat, If, Mux, Signal

from litestereo.gateware.cameras.frame_guard import DAMAGES
from litestereo.gateware.cameras.layouts import SIDES
from litestereo.gateware.cameras.pair_join import PairJoin
from litestereo.gateware.cameras.parameters import CameraParameters

from .proof import Proof
from .streams import counted, feed, held, stays, taken

#: Frames of four pixels at most; a queue has room for all of them.
SMALL  = CameraParameters(max_width=2, max_height=2, silence_bits=2, skew_pixels=16)
PIXELS = 4


def pair_join(make=PairJoin) -> Proof:
    """Prove frames of any size and sensors that start at any time; what follows opens and closes at any time."""
    core   = make(SMALL)
    proof  = Proof(core)
    source = core.source
    proof.free(core.width, core.height, core.open, source.ready, core.waits, core.side, core.paired,
               *core.found.flatten(), *core.starts)
    silence = proof.constant(len(core.silence))
    proof.comb += core.silence.eq(silence)
    proof.assume("the size is legal", (core.width <= SMALL.max_width) & (core.height <= SMALL.max_height))
    started = Signal()
    proof.comb += started.eq(core.starts[0] | core.starts[1])
    proof.assume("a pair is found in the clock after a start", ~core.paired | (proof.started & proof.past(started)))
    found = Signal(len(Cat(*core.found.flatten())))
    proof.comb += found.eq(Cat(*core.found.flatten()))
    proof.assume("and what is known of it holds", core.paired | (found == proof.past(found)))
    frames = [_guard(proof, core, number) for number in range(len(SIDES))]
    _pairs(proof, core, frames)
    _matches(proof, core, frames, silence, found)
    return proof


def _guard(proof: Proof, core: PairJoin, number: int) -> SimpleNamespace:
    """Give out the frames of a guard; return what is known of the newest one."""
    sink = core.sinks[number]
    side = SIDES[number]
    begun, dropped, ended = core.begun[number], core.dropped[number], core.ended[number]
    damages = core.damages[number]
    feed(proof, sink)
    proof.free(begun, dropped, ended, damages)
    frame = SimpleNamespace(open=Signal(), width=Signal(2), height=Signal(2), total=Signal(3), fresh=Signal(),
                            pixels=Array(Signal(len(sink.pixel)) for _ in range(PIXELS)),
                            damages=Signal(len(DAMAGES)))
    frame.given = counted(proof, taken(sink), begun, 3)
    # Its size is 1 or 2 each way.
    proof.comb += frame.total.eq(Mux(frame.width[1], 2, 1) << frame.height[1])
    proof.sync += [
        If(taken(sink),
            frame.pixels[frame.given[:2]].eq(sink.pixel)
        ),
        If(ended,
            frame.open.eq(0),
            frame.damages.eq(damages)
        ),
        If(core.starts[number],
            frame.fresh.eq(0)
        ),
        If(begun,
            frame.open.eq(1),
            frame.fresh.eq(1),
            frame.width.eq(core.frame_width),
            frame.height.eq(core.frame_height)
        ),
    ]
    proof.assume(f"{side}: the guard begins a frame when it may", ~begun | (core.accept[number] & ~frame.open))
    proof.assume(f"{side}: it begins a frame or drops it", ~begun | ~dropped)
    proof.assume(f"{side}: it gives the pixels of its frame", ~sink.valid | (
        frame.open & (frame.given < frame.total) & (sink.first == (frame.given == 0))
        & (sink.last == (frame.given == frame.total - 1))))
    proof.assume(f"{side}: it ends the frame after the last one", ~ended | (
        frame.open & (frame.given == frame.total) & ~begun))
    proof.assume(f"{side}: then the damages hold", frame.open | (damages == proof.past(damages)))
    proof.prove(f"{side}: a queue with room for a frame accepts all of it", ~sink.valid | sink.ready)
    proof.prove(f"{side}: no frame begins while a pair is under way", ~core.accept[number] | ~core.busy)
    proof.prove(f"{side}: no frame of no pixels begins", ~core.accept[number] | (
        (core.frame_width != 0) & (core.frame_height != 0)))
    proof.prove(f"{side}: the size of a frame holds while it is inside", core.queues[number].empty | (
        (frame.width == core.frame_width) & (frame.height == core.frame_height)))
    return frame


def _pairs(proof: Proof, core: PairJoin, frames: list[SimpleNamespace]) -> None:
    """Prove that a pair is whole."""
    source      = core.source
    left, right = frames
    sent        = counted(proof, taken(source), core.begins, 4)
    under_way   = Signal()
    proof.sync += [
        If(core.finished | core.given_up,
            under_way.eq(0)
        ),
        If(core.begins,
            under_way.eq(1)
        ),
    ]
    proof.prove("what is offered stays, unless the pair is given up", proof.past(core.given_up) | stays(proof, source))
    proof.prove("pixel pairs are of a pair", ~source.valid | under_way)
    proof.prove("a pair is under way from its begin to its end", core.busy == under_way)
    proof.prove("it begins when none is", ~core.begins | ~under_way)
    proof.prove("it ends once", ~(core.finished | core.given_up) | (under_way & ~(core.finished & core.given_up)))
    proof.prove("its frames have one size", ~under_way | ((left.width == right.width) & (left.height == right.height)))
    proof.prove("no pixel pair too many", ~source.valid | (sent < left.total))
    proof.prove("no pixel pair too few", ~core.finished | (sent == left.total))
    proof.prove("the first pixel pair, and no other, is marked", ~source.valid | (source.first == (sent == 0)))
    proof.prove("so is the last", ~source.valid | (source.last == (sent == left.total - 1)))
    for name, frame in zip(SIDES, frames, strict=True):
        proof.prove(f"{name}: pixels leave in their places",
                    ~source.valid | (getattr(source, name) == frame.pixels[sent[:2]]))
        proof.prove(f"{name}: a pixel leaves after it has come", ~source.valid | (sent < frame.given))
    proof.prove("a pair has ended when both guards have ended their frames", ~core.finished | ~(left.open | right.open))
    proof.prove("then it has the damages of both", ~proof.past(core.finished)
                | (core.flags == Cat(left.damages, right.damages)))
    proof.prove("only a successor that closes gives up a pair", ~core.given_up | ~core.open)
    proof.prove("and in that clock, unless all of it has left", ~under_way | core.open | core.given_up
                | (sent == left.total) | (taken(source) & source.last))
    ends = counted(proof, core.finished, 0, 2)
    proof.reach("a pair of two pixels without damages, the right one first", core.finished & (left.total == 2)
                & (core.flags == 0) & proof.past(under_way) & (sent == 2))
    proof.reach("a pair is given up after a pixel", core.given_up & (sent == 1))
    proof.reach("a second pair begins", core.begins & (ends == 1))


def _matches(proof: Proof, core: PairJoin, frames: list[SimpleNamespace], silence: Signal, found: Signal) -> None:
    """Prove that each pair that was found begins or is refused."""
    waits  = Signal()   # A pair is found, and has not begun.
    age    = Signal(4)  # Clocks since then.
    closed = Signal()   # What follows was closed since the last pair began.
    asked  = Signal()
    proof.comb += asked.eq(waits | core.paired)
    proof.sync += [
        waits.eq(asked & ~core.begins & ~core.refused),
        If(waits,
            age.eq(age + 1)
        ).Else(
            age.eq(0)
        ),
        If(core.begins,
            closed.eq(0)
        ),
        If(~core.open,
            closed.eq(1)
        ),
    ]
    proof.prove("a pair that begins or is refused was found", ~(core.begins | core.refused) | asked)
    proof.prove("it does one of them", ~core.begins | ~core.refused)
    proof.prove("before another one is found", ~(waits & core.paired))
    proof.prove("and not later than after a silence", ~waits | (age <= silence))
    proof.prove("a pair begins when what follows takes one", ~core.begins | (core.open & closed))
    for name, frame in zip(SIDES, frames, strict=True):
        proof.prove(f"{name}: the frame of a pair has begun since the newest start", ~core.begins | frame.fresh)
    info = Signal(len(found))
    proof.comb += info.eq(Cat(*core.info.flatten()))
    proof.prove("what is known of it is that of the pair", ~proof.past(core.begins) | (info == proof.past(found)))
    proof.prove("and holds", ~proof.started | proof.past(core.begins) | held(proof, info, 1))
    proof.reach("a pair is refused after a silence", core.refused & (age == 3) & core.open)
