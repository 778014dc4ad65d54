#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

# Pair Gate ----------------------------------------------------------------------------------------

class PairGate(LiteXModule):
    """Let the pixel pairs of one frame pass from the wire to the matcher, in their order.

    The gate is opened for a frame: its id and how many pixels an image has. It takes the frame's chunks one after the other and is
    closed when the last pair has passed, or by `close`, which throws away what is under way.

    A chunk is judged from its `frame_id`, `offset` and `length`, which stand still while `judge` is 1. The verdict is there with
    `judged`; `begin` then lets the chunk's words pass.
    """
    def __init__(self):
        self.sink   = stream.Endpoint([("data", 32)])       # Payload of the chunk that was let in: two pairs a word, the first in the low bits.
        self.source = stream.Endpoint(pixel_pair_layout())  # Pairs, marked first and last of the frame.
        # Frame.
        self.frame_id = Signal(32) # Of the frame to open the gate for.
        self.pixels   = Signal(32) # Of one image, at least 1.
        self.open     = Signal()   # Open (pulse).
        self.close    = Signal()   # Close (pulse).
        self.opened   = Signal()   # Pairs are missing.
        self.offset   = Signal(32) # Of the chunk that comes next.
        # Chunk to judge.
        self.chunk_frame_id = Signal(32)
        self.chunk_offset   = Signal(32)
        self.chunk_length   = Signal(32)
        self.judge          = Signal()
        # Verdict.
        self.judged   = Signal()
        self.fits     = Signal()   # It is the next one.
        self.repeated = Signal()   # It has passed before.
        self.begin    = Signal()   # Let it pass (pulse).

        # # #

        # Frame.
        # ------
        frame_id = Signal(32)
        left     = Signal(32)     # Bytes of chunks that are still to come,
        whole    = Signal()       # of which the next one is not the last,
        expected = Signal(11)     # and has so many bytes.
        inside   = Signal()       # The words that come are of a chunk that was let in since the gate was opened.
        pairs    = Signal(32)     # Pairs that have not passed.
        first    = Signal()
        passes   = Signal()
        changed  = Signal(2)      # Opened or closed in the last clocks: a verdict of these is of the frame before.
        self.comb += [
            whole.eq(left[10:] != 0),
            expected.eq(Mux(whole, CHUNK_BYTES, left[:10])),
            passes.eq(self.source.valid & self.source.ready),
        ]
        self.sync += [
            changed.eq(Cat(self.open | self.close, changed[0])),
            # Not let in, a chunk's words are thrown away.
            If(self.begin & (changed == 0),
                inside.eq(1),
                self.offset.eq(self.offset + expected),
                left.eq(left - expected)
            ),
            If(passes,
                first.eq(0),
                pairs.eq(pairs - 1),
                If(self.source.last,
                    self.opened.eq(0)
                )
            ),
            If(self.sink.valid & self.sink.ready & self.sink.last,
                inside.eq(0)
            ),
            If(self.open,
                frame_id.eq(self.frame_id),
                left.eq(Cat(C(0, 1), self.pixels)),
                pairs.eq(self.pixels),
                self.offset.eq(0),
                first.eq(1),
                self.opened.eq(1)
            ),
            If(self.open | self.close,
                inside.eq(0)
            ),
            If(self.close,
                self.opened.eq(0)
            ),
        ]

        # Verdict, a register after each step.
        # ------------------------------------
        known   = Signal()
        follows = Signal()
        earlier = Signal()
        sized   = Signal()
        through = Signal()
        self.sync += [
            known.eq(self.chunk_frame_id == frame_id),
            follows.eq(self.chunk_offset == self.offset),
            earlier.eq((self.chunk_offset < self.offset) & (self.chunk_offset[:10] == 0)),
            sized.eq((self.chunk_length == expected) & (expected != 0)),
            self.fits.eq(self.opened & known & follows & sized),
            self.repeated.eq(known & earlier),
            through.eq(self.judge & ~self.judged),
            self.judged.eq(through & self.judge & ~self.judged),
        ]

        # Words to pairs.
        # ---------------
        lane = Signal()
        pair = Signal(2*PIXEL_BITS)
        self.comb += [
            pair.eq(Mux(lane, self.sink.data[16:], self.sink.data[:16])),
            self.source.left.eq(pair[:PIXEL_BITS]),
            self.source.right.eq(pair[PIXEL_BITS:]),
            self.source.first.eq(first),
            self.source.last.eq(pairs == 1),
            self.source.valid.eq(self.sink.valid & inside),
            self.sink.ready.eq(~inside | (self.source.ready & (lane | self.source.last))),
        ]
        self.sync += [
            If(passes,
                lane.eq(~lane)
            ),
            If(self.sink.valid & self.sink.ready,
                lane.eq(0)
            ),
        ]
