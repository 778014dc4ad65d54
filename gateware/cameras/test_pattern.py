#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from .dvp_signals import DVPFormat, DVPSignals
from .noise       import Noise

BLANKING_BITS = 16   # Of a blanking in clocks.
CHROMA        = 0x80 # The other byte of a pixel of two: no colour.

# Test Pattern -------------------------------------------------------------------------------------

@ResetInserter()
class TestPattern(LiteXModule):
    """The signals of a sensor that sees noise, to test a capture without a sensor.

    Rows are noise, each another one, the same in every frame. Pixel x of a row is number x + `shift` of its noise. So
    of two sensors, the left one with a shift of 0, the right one with one of d, the disparity is d everywhere.

    It is in the domain of the pixel clock. A frame begins when `run` is 1 and the blanking between frames is over, and
    is then finished. A blanking of `row_blanking` clocks is in front of each row, where the noise is moved on, and
    after the last one.
    """
    def __init__(self, parameters):
        self.sensor         = DVPSignals()                         # Signals of the sensor.
        self.format         = DVPFormat()                          # How it uses them.
        self.run            = Signal()                             # Begin frames.
        self.width          = Signal(max=parameters.max_width + 1)  # Columns of a frame, from 1 up.
        self.height         = Signal(max=parameters.max_height + 1) # Rows of a frame, from 1 up.
        self.shift          = Signal(8)                            # Pixels of the noise in front of the first column.
        self.row_blanking   = Signal(BLANKING_BITS)                # Clocks between rows, from `shift` + 1 up.
        self.frame_blanking = Signal(BLANKING_BITS)                # Clocks between frames, from 2 up.

        # # #

        self.noise = Noise()
        self.add_counts()
        self.add_fsm()
        self.add_signals()

    def add_counts(self):
        """Count clocks of a blanking, pixels and their bytes, rows."""
        self.clock  = Signal(BLANKING_BITS) # Clocks of the blanking, from 1 on.
        self.column = Signal.like(self.width)
        self.row    = Signal.like(self.height)
        self.second = Signal() # The second byte of a pixel.
        self.whole  = Signal() # The last byte of a pixel.
        self.comb += [
            self.whole.eq(~self.format.two_bytes | self.second),
            self.noise.row.eq(self.row),
        ]

    def add_fsm(self):
        """Follow a frame: blanking, then each row with the blanking in front of it."""
        noise = self.noise
        self.fsm = fsm = FSM(reset_state="BLANK")
        fsm.act("BLANK",
            NextValue(self.row, 0),
            If(self.clock < self.frame_blanking,
                NextValue(self.clock, self.clock + 1)
            ).Elif(self.run,
                NextValue(self.clock, 1),
                NextState("ROW-BLANK")
            )
        )
        fsm.act("ROW-BLANK",
            noise.seed.eq(self.clock == 1),
            noise.step.eq(self.clock <= self.shift + 1),
            NextValue(self.column, 0),
            NextValue(self.second, 0),
            NextValue(self.clock, self.clock + 1),
            If(self.clock >= self.row_blanking,
                NextValue(self.clock, 1),
                NextState("ROW"),
                If(self.row == self.height,
                    NextState("BLANK")
                )
            )
        )
        fsm.act("ROW",
            noise.step.eq(self.whole),
            NextValue(self.second, self.format.two_bytes & ~self.second),
            If(self.whole,
                NextValue(self.column, self.column + 1),
                If(self.column + 1 == self.width,
                    NextValue(self.row, self.row + 1),
                    NextState("ROW-BLANK")
                )
            )
        )

    def add_signals(self):
        """Register the signals, as a sensor does, with their polarity."""
        sensor, format = self.sensor, self.format
        in_row = self.fsm.ongoing("ROW")
        self.sync += [
            sensor.vsync.eq(self.fsm.ongoing("BLANK") == format.vsync_low),
            sensor.href.eq(in_row ^ format.href_low),
            sensor.data.eq(Mux(format.two_bytes & (self.second != format.grey_second), CHROMA, self.noise.pixel)),
        ]
