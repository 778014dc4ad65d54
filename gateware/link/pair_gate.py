#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common     import *
from .chunk_check import ChunkCheck
from .message     import *

# Pair Gate ----------------------------------------------------------------------------------------

class PairGate(LiteXModule):
    """Let the pixel pairs of one frame pass from the wire to the matcher, in their order.

    The gate is opened for a frame: its id and how many pixels an image has. It takes the frame's chunks one after the
    other and is closed when the last pair has passed, or by `close`, which discards what is under way.

    A chunk that fits is admitted by `begin`, in the clock of its verdict; then its words come.

    It is reset with its clock domain alone.
    """
    def __init__(self):
        self.sink    = stream.Endpoint([("data", 32)])      # Payload of a chunk, two pairs a word, the first one low.
        self.source  = stream.Endpoint(pixel_pair_layout()) # Pairs, marked first and last of the frame.
        self.latency = None                                 # Two pairs share a word: the second passes after the first.
        # Frame.
        self.frame_id = Signal(32) # Of the frame to open the gate for.
        self.pixels   = Signal(32) # Of one image, at least 1.
        self.open     = Signal()   # Open (pulse).
        self.close    = Signal()   # Close (pulse).
        self.opened   = Signal()   # Pairs are missing.
        self.offset   = Signal(32) # Of the chunk that comes next.
        # Chunk to judge.
        self.chunk    = ChunkCheck() # It fits: it is the one that comes next.
        self.begin    = Signal()     # Admit it (pulse).

        # # #

        self.expected = Signal(11) # Bytes of the chunk that comes next.
        self.inside   = Signal()   # The words that come are of a chunk that was admitted since the gate was opened.
        self.first    = Signal()   # The next pair is the first of the frame.
        self.final    = Signal()   # All chunks have come, or are under way.
        self.odd      = Signal()   # The frame has an odd number of pairs: its last word has only one.
        self.passes   = Signal()   # A pair passes.

        self.add_frame()
        self.add_verdict()
        self.add_pairs()

    def add_frame(self):
        """Open and close the gate, and count chunks and pairs."""
        remaining = Signal(32) # Bytes of the chunks that have not come.
        whole     = Signal()   # The next one of these has 1024 bytes.
        changed   = Signal(2)  # Opened or closed in the last two clocks: a verdict of these is of the frame before.
        self.comb += [
            whole.eq(remaining[10:] != 0),
            self.final.eq(~whole & (remaining[:10] == 0)),
            self.expected.eq(Mux(whole, CHUNK_BYTES, remaining[:10])),
            self.passes.eq(self.source.valid & self.source.ready),
        ]
        self.sync += [
            changed.eq(Cat(self.open | self.close, changed[0])),
            # Words of a chunk that was not admitted are discarded.
            If(self.begin & (changed == 0),
                self.inside.eq(1),
                If(whole,
                    self.offset[10:].eq(self.offset[10:] + 1),
                    remaining[10:].eq(remaining[10:] - 1)
                ).Else(
                    self.offset[:10].eq(remaining[:10]),
                    remaining[:10].eq(0)
                )
            ),
            If(self.passes,
                self.first.eq(0),
                If(self.source.last,
                    self.opened.eq(0)
                )
            ),
            If(self.sink.valid & self.sink.ready & self.sink.last,
                self.inside.eq(0)
            ),
            If(self.open,
                remaining.eq(Cat(C(0, 1), self.pixels)),
                self.odd.eq(self.pixels[0]),
                self.offset.eq(0),
                self.first.eq(1),
                self.opened.eq(1)
            ),
            If(self.open | self.close,
                self.inside.eq(0)
            ),
            If(self.close,
                self.opened.eq(0)
            ),
        ]

    def add_verdict(self):
        """Judge a chunk, with a register after each step."""
        chunk    = self.chunk
        frame_id = Signal(32) # Of the frame that the gate is open for.
        known    = Signal()   # The chunk is of that frame,
        follows  = Signal()   # begins where the next one has to,
        earlier  = Signal()   # or before that,
        sized    = Signal()   # and has the length of the next one.
        compared = Signal()   # These four are of the chunk that is judged.
        self.sync += [
            If(self.open,
                frame_id.eq(self.frame_id)
            ),
            known.eq(chunk.frame_id == frame_id),
            follows.eq(chunk.offset == self.offset),
            earlier.eq((chunk.offset < self.offset) & (chunk.offset[:10] == 0)),
            sized.eq((chunk.length == self.expected) & ~self.final),
            chunk.fits.eq(self.opened & known & follows & sized),
            chunk.repeated.eq(known & earlier),
            compared.eq(chunk.judge & ~chunk.judged),
            chunk.judged.eq(compared & chunk.judge & ~chunk.judged),
        ]

    def add_pairs(self):
        """Give out the two pairs of each word."""
        lane = Signal() # Pair of the word that is next.
        pair = Signal(2*PIXEL_BITS)
        self.comb += [
            pair.eq(Mux(lane, self.sink.data[16:], self.sink.data[:16])),
            self.source.left.eq(pair[:PIXEL_BITS]),
            self.source.right.eq(pair[PIXEL_BITS:]),
            self.source.first.eq(self.first),
            self.source.last.eq(self.final & self.sink.last & (lane | self.odd)),
            self.source.valid.eq(self.sink.valid & self.inside),
            self.sink.ready.eq(~self.inside | (self.source.ready & (lane | self.source.last))),
        ]
        self.sync += [
            If(self.passes,
                lane.eq(~lane)
            ),
            If(self.sink.valid & self.sink.ready,
                lane.eq(0)
            ),
        ]
