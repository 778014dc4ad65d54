#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common      import PIXEL_BITS
from .dvp_signals import DVPFormat, DVPSignals
from .layouts     import *

# DVP Receiver -------------------------------------------------------------------------------------

@ResetInserter()
class DVPReceiver(LiteXModule):
    """The pixels of a sensor with a parallel port, with marks where it begins and ends frames and ends rows.

    It is in the domain of the pixel clock; the edge at which the sensor's signals are stable is chosen by the clock of
    that domain. A row is the clocks in which HREF is active during a frame. What is outside of a frame is ignored, also
    the rest of a frame that is under way when the reset ends.

    There is at most one item per clock, as the begin of a frame comes out a clock early. Without the latency:

        frame active   0 0 1 1 1 1 1 1 1 1 1 1 0 0
        row active     0 0 0 1 1 1 0 0 1 1 1 0 0 0
        source           B   P P P E   P P P E F       FRAME_BEGIN, PIXEL, ROW_END, FRAME_END

    A row that ends with its frame has no mark. Nor has a frame end a single clock before the next frame: `FRAME_BEGIN`
    says that too. Of a pixel of two bytes whose second byte is missing there is an item only if the first one is the
    grey value.
    """
    def __init__(self):
        self.sensor  = DVPSignals()                     # Signals of the sensor.
        self.format  = DVPFormat()                      # How it uses them.
        self.source  = stream.Endpoint(sensor_layout()) # Pipeline: pixels and marks.
        self.active  = Signal()                         # A frame is under way.
        self.latency = 3                                # From a byte to its pixel: input, neighbours, output.

        # # #

        self.add_stages()
        self.add_bytes()
        self.add_items()

    def add_stages(self):
        """Register the signals, without their polarity, for three clocks: `now`, `then`, `before`."""
        stages = ("now", "then", "before")
        self.frame = frame = [Signal(name=f"frame_{stage}") for stage in stages]
        self.row   = row   = [Signal(name=f"row_{stage}")   for stage in stages]
        self.data  = data  = [Signal(PIXEL_BITS, reset_less=True, name=f"data_{stage}") for stage in stages[:2]]
        between = Signal() # VSYNC is inactive,
        seen    = Signal() # and has been since the reset.
        inside  = Signal()
        self.comb += [
            between.eq(self.sensor.vsync == self.format.vsync_low),
            inside.eq(~between & seen),
            self.active.eq(frame[0]),
        ]
        self.sync += [
            seen.eq(seen | between),
            frame[0].eq(inside),
            row[0].eq(inside & (self.sensor.href ^ self.format.href_low)),
            data[0].eq(self.sensor.data),
            [later.eq(earlier) for stages in (frame, row, data) for earlier, later in zip(stages, stages[1:])],
        ]

    def add_bytes(self):
        """Find out whether the byte of `then` is a grey value."""
        second    = Signal() # It is the second byte of a pixel.
        self.grey = Signal()
        self.comb += self.grey.eq(self.row[1] & (~self.format.two_bytes | (second == self.format.grey_second)))
        self.sync += If(self.row[1],
            second.eq(~second)
        ).Else(
            second.eq(0)
        )

    def add_items(self):
        """Give out a pixel or a mark."""
        source = self.source
        now, then, before = range(3)
        self.sync += [
            source.valid.eq(1),
            source.pixel.eq(self.data[then]),
            If(self.frame[now] & ~self.frame[then],
                source.kind.eq(FRAME_BEGIN)
            ).Elif(self.row[then],
                source.valid.eq(self.grey),
                source.kind.eq(PIXEL)
            ).Elif(self.frame[before] & ~self.frame[then],
                source.kind.eq(FRAME_END)
            ).Elif(self.row[before],
                source.kind.eq(ROW_END)
            ).Else(
                source.valid.eq(0)
            ),
        ]
