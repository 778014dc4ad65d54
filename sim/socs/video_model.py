#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.cores.video  import video_data_layout
from litex.soc.interconnect import stream

from ...gateware.common.parameters import check

# Video PHY Model ----------------------------------------------------------------------------------

class VideoPHYModel(LiteXModule):
    """PHY of the simulation: what an HDMI PHY would encode, as it is, and the clock of the pixels.

    Parameters
    ----------
    pads
        `clk`, `de`, `hsync`, `vsync`, and 8 bits each of `r`, `g` and `b`.
    domain : str
        Clock domain of the pixels, created here.
    clocks_per_pixel : int
        Clocks of `sys` in one of the pixels, 2 at least.
    """
    def __init__(self, pads, domain, clocks_per_pixel):
        check(clocks_per_pixel >= 2, "clocks_per_pixel must be at least 2.")
        self.sink      = sink = stream.Endpoint(video_data_layout)
        self.cd_count  = cd_count  = ClockDomain(reset_less=True)
        self.cd_pixels = cd_pixels = ClockDomain(domain)

        # # #

        # It goes on while `sys` is in reset, for the pixels' side to see that.
        count = Signal(max=clocks_per_pixel)
        self.sync.count += [
            count.eq(count + 1),
            If(count == clocks_per_pixel - 1, count.eq(0)),
            pads.clk.eq(count == 0),
        ]
        self.comb += [
            cd_count.clk.eq(ClockSignal("sys")),
            cd_pixels.clk.eq(pads.clk),
            cd_pixels.rst.eq(ResetSignal("sys")),
            # A monitor does not wait, and takes what there is.
            sink.ready.eq(1),
            *(getattr(pads, name).eq(getattr(sink, name)) for name in ("de", "hsync", "vsync", "r", "g", "b")),
        ]
