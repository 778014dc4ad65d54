#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.fifo import SyncFIFOBuffered

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import PIXEL_BITS
from .layouts import *

# Frame Queue --------------------------------------------------------------------------------------

@ResetInserter()
class FrameQueue(LiteXModule):
    """Hold the frame of one sensor until it is known whether it is one of a pair; then it leaves, or is discarded.

    A frame that has begun is held while `hopeful` is 1, and discarded when that falls, or when its sensor starts again.
    It leaves from `release` on. `discard` gives it up at any time. Pixels leave or are discarded up to the last one of
    the frame, so the guard ends it as any other.

    While a frame is held there is room for `skew_pixels` of it: as many as its sensor may be ahead of the other one.

    Pixels of a frame that began before a reset are ignored.
    """
    def __init__(self, parameters):
        self.sink     = stream.Endpoint(pixel_layout()) # Frames of the guard.
        self.source   = stream.Endpoint(pixel_layout()) # The frame that leaves, the last pixel marked.
        # From capture and guard.
        self.starts   = Signal() # The sensor starts a frame (pulse).
        self.begun    = Signal() # The guard begins it (pulse),
        self.dropped  = Signal() # or drops it (pulse).
        self.ended    = Signal() # The guard has ended its frame (pulse).
        # Control.
        self.hopeful  = Signal() # The newest start of the sensor is one of a pair, or may become that.
        self.release  = Signal() # The frame that is held leaves (pulse).
        self.discard  = Signal() # The frame that is held or leaves is discarded (pulse).
        # Status.
        self.empty    = Signal() # No frame is inside.
        self.held     = Signal() # A frame is held.
        self.absent   = Signal() # The guard has dropped the frame of the newest start.
        self.complete = Signal() # The guard has ended the frame that is inside, or was last.
        self.latency  = None     # A frame is held.

        # # #

        self.add_pixels(parameters)
        self.add_fsm()
        self.add_guard()

    def add_pixels(self, parameters):
        """Queue the pixels of frames that have begun."""
        inside    = Signal() # A frame has begun, and has pixels to come.
        self.fifo = fifo = SyncFIFOBuffered(PIXEL_BITS + 1, parameters.skew_pixels)
        self.comb += [
            fifo.din.eq(Cat(self.sink.pixel, self.sink.last)),
            fifo.we.eq(self.sink.valid & inside),
            self.sink.ready.eq(fifo.writable | ~inside),
            Cat(self.source.pixel, self.source.last).eq(fifo.dout),
        ]
        self.sync += If(self.begun,
            inside.eq(1)
        ).Elif(fifo.we & fifo.writable & self.sink.last,
            inside.eq(0)
        )

    def add_fsm(self):
        """Follow a frame from its begin until its last pixel is out of the queue."""
        fifo   = self.fifo
        source = self.source
        ends   = Signal() # The last pixel leaves, or is discarded.
        self.comb += ends.eq(fifo.readable & fifo.re & source.last)
        self.fsm = fsm = FSM(reset_state="EMPTY")
        fsm.act("EMPTY",
            self.empty.eq(1),
            If(self.begun,
                NextState("HELD")
            )
        )
        fsm.act("HELD",
            self.held.eq(1),
            If(self.discard | self.starts | ~self.hopeful,
                NextState("DISCARD")
            ).Elif(self.release,
                NextState("LEAVE")
            )
        )
        fsm.act("LEAVE",
            source.valid.eq(fifo.readable),
            fifo.re.eq(source.ready),
            If(ends,
                NextState("EMPTY")
            ).Elif(self.discard,
                NextState("DISCARD")
            )
        )
        fsm.act("DISCARD",
            fifo.re.eq(1),
            If(ends,
                NextState("EMPTY")
            )
        )

    def add_guard(self):
        """Remember what the guard did with its newest frame."""
        self.sync += [
            If(self.dropped,
                self.absent.eq(1)
            ),
            If(self.starts,
                self.absent.eq(0)
            ),
            If(self.ended,
                self.complete.eq(1)
            ),
            If(self.begun,
                self.complete.eq(0)
            ),
        ]
