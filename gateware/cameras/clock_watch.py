#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

DIVIDER_BITS = 4 # Half a period of the divided clock is 8 pixel clocks: the system's may be up to 7 times as long.

# Clock Watch --------------------------------------------------------------------------------------

class ClockWatch(LiteXModule):
    """Tell whether the clock of a sensor runs, as seen from the system's: between frames too, and without any signal.

    Each eighth edge of the clock is seen. The clock counts as stopped when none has come for `limit` clocks of the
    system, and as running from the next one on. A reset of the system makes it stopped until then.

    Parameters
    ----------
    bits : int
        Bits of the limit.
    cd_pixel : str
        Domain of the pixel clock.
    """
    def __init__(self, bits, cd_pixel="pixel"):
        self.limit = Signal(bits) # Longest time of eight pixel clocks, in clocks of the system.
        self.runs  = Signal()     # The clock runs.

        # # #

        edges  = Signal(DIVIDER_BITS, reset_less=True)
        half   = Signal()
        before = Signal(reset_less=True)
        clocks = Signal(bits)
        sync   = getattr(self.sync, cd_pixel)
        sync += edges.eq(edges + 1)
        self.specials += MultiReg(edges[-1], half)
        self.sync += [
            before.eq(half),
            If(half ^ before,
                clocks.eq(0),
                self.runs.eq(1)
            ).Elif(clocks == self.limit,
                self.runs.eq(0)
            ).Else(
                clocks.eq(clocks + 1)
            ),
        ]
