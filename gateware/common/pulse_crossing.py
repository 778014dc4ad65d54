#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import GrayCounter, MultiReg

from litex.gen import *

# Pulse Crossing -----------------------------------------------------------------------------------

class PulseCrossing(LiteXModule):
    """Pulses from one clock domain to another: each comes out once, as one clock, however close together they came.

    Parameters
    ----------
    cd_from, cd_to : str
        Clock domains; a reset must hold both for some clocks.
    most : int
        Pulses that may be under way at once.
    """
    def __init__(self, cd_from, cd_to, most=1):
        self.i = Signal() # In `cd_from`.
        self.o = Signal() # In `cd_to`.

        # # #

        # One side counts the pulses that came in. The other counts those that went out, up to what it sees of the first
        # count: the difference is under way.
        bits    = max(2, bits_for(most))
        come    = ClockDomainsRenamer(cd_from)(GrayCounter(bits))
        gone    = ClockDomainsRenamer(cd_to)(GrayCounter(bits))
        counted = Signal(bits) # `come`, as the other side sees it.
        self.submodules += come, gone
        self.specials   += MultiReg(come.q, counted, cd_to)
        self.comb += [
            come.ce.eq(self.i),
            self.o.eq(gone.q != counted),
            gone.ce.eq(self.o),
        ]
