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
    """PHY of the simulation: passes on, not encoded, what an HDMI PHY would encode, and makes the pixel clock.

    Parameters
    ----------
    pads
        `clk`, `de`, `hsync`, `vsync`, and 8 bits each of `r`, `g` and `b`.
    domain : str
        Clock domain of the pixels, which the PHY creates.
    clocks_per_pixel : int
        Clocks of `sys` per pixel clock, at least 2.
    """
    def __init__(self, pads, domain, clocks_per_pixel):
        check(clocks_per_pixel >= 2, "clocks_per_pixel must be at least 2.")
        self.sink      = sink = stream.Endpoint(video_data_layout)
        self.cd_count  = cd_count  = ClockDomain(reset_less=True)
        self.cd_pixels = cd_pixels = ClockDomain(domain)

        # # #

        # It runs while `sys` is in reset, so that the pixel clock domain sees the reset.
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
            # A monitor does not wait: it accepts each pixel as it comes.
            sink.ready.eq(1),
            *(getattr(pads, name).eq(getattr(sink, name)) for name in ("de", "hsync", "vsync", "r", "g", "b")),
        ]
