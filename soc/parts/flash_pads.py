#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pads of a flash as LiteX's `SPIMaster` expects them: clk, cs_n, mosi, miso."""

from migen import *
from migen.fhdl.specials import Tristate

from litex.gen import *

class ECP5FlashPads(LiteXModule):
    """The configuration flash of an ECP5, whose clock is at a primitive, not at a pin."""
    def __init__(self, pads):
        self.clk  = Signal() # To the primitive.
        self.cs_n = pads.cs_n
        self.mosi = pads.mosi
        self.miso = pads.miso

        # # #

        self.specials += Instance("USRMCLK", i_USRMCLKI=self.clk, i_USRMCLKTS=0)
        hold_high(self, pads)

class FlashPads(LiteXModule):
    """A flash at ordinary pins: `clk`, `cs_n`, and `mosi`, `miso` or `dq` of four bits."""
    def __init__(self, pads):
        self.clk  = pads.clk
        self.cs_n = pads.cs_n
        if hasattr(pads, "dq"):
            self.mosi, self.miso, wp, hold = pads.dq
            # An assignment to two of the pins would drive the other two too.
            self.specials += [Tristate(pin, o=1, oe=1) for pin in (wp, hold)]
        else:
            self.mosi = pads.mosi
            self.miso = pads.miso
            hold_high(self, pads)

def hold_high(module, pads):
    """Drive high those pins of a flash that only its wider modes use."""
    for name in ("wp", "hold"):
        if hasattr(pads, name):
            module.comb += getattr(pads, name).eq(1)
