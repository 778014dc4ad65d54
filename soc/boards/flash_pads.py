#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pads of a flash as LiteX's `SPIMaster` wants them: clk, cs_n, mosi, miso."""

from migen import *

from litex.gen import *

class FlashPads(LiteXModule):
    """A flash at pins of its own; those of the wider modes, which are not used, are held high.

    Parameters
    ----------
    pads : Record
        Of the platform: `cs_n`, `mosi`, `miso`, or `cs_n`, `dq` of four bits.
    clk : Signal, optional
        Instead of the pad `clk`.
    """
    def __init__(self, pads, clk=None):
        self.clk  = pads.clk if clk is None else clk
        self.cs_n = pads.cs_n
        if hasattr(pads, "dq"):
            self.mosi, self.miso, wp, hold = pads.dq
            unused = [wp, hold]
        else:
            self.mosi, self.miso = pads.mosi, pads.miso
            unused = [getattr(pads, name) for name in ("wp", "hold") if hasattr(pads, name)]

        # # #

        self.comb += [pad.eq(1) for pad in unused]

class ECP5FlashPads(FlashPads):
    """The configuration flash of an ECP5, which has that clock at a primitive, not at a pin."""
    def __init__(self, pads):
        FlashPads.__init__(self, pads, clk=Signal())
        self.specials += Instance("USRMCLK", i_USRMCLKI=self.clk, i_USRMCLKTS=0)
