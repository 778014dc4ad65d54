#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from .crossing_reset import CrossingReset, GrayPointer

# Pulse Crossing -----------------------------------------------------------------------------------

class PulseCrossing(LiteXModule):
    """Pulses from one clock domain to another: each comes out once, as one clock, however close together they came.

    A reset of either domain discards those under way. Pulses that come while both sides agree on that wait: see
    `CrossingReset`.

    Parameters
    ----------
    cd_from, cd_to : str
        Clock domains.
    most : int
        Pulses that may be under way at once.
    reset : CrossingReset, optional
        Of both domains, if crossings share one.
    """
    def __init__(self, cd_from, cd_to, most=1, reset=None):
        self.i = Signal() # In `cd_from`.
        self.o = Signal() # In `cd_to`.

        # # #

        # One side counts the pulses that came in. The other counts those that went out, up to what it sees of the first
        # count: the difference is under way.
        bits    = max(2, bits_for(most))
        come    = ClockDomainsRenamer(cd_from)(GrayPointer(bits))
        gone    = ClockDomainsRenamer(cd_to)(GrayPointer(bits))
        counted = Signal(bits) # `come`, as the other side sees it.
        waiting = Signal(bits) # Pulses that came while a reset was under way.
        self.submodules += come, gone
        self.specials   += MultiReg(come.q, counted, cd_to)
        if reset is None:
            self.reset = reset = CrossingReset(cd_from, cd_to)
        self.comb += [
            come.clear.eq(reset.clear[cd_from]),
            gone.clear.eq(reset.clear[cd_to]),
            come.ce.eq((self.i | (waiting != 0)) & ~reset.blocked[cd_from]),
            self.o.eq((gone.q != counted) & ~reset.blocked[cd_to]),
            gone.ce.eq(self.o),
        ]
        sync  = getattr(self.sync, cd_from)
        sync += waiting.eq(waiting + self.i - come.ce)
