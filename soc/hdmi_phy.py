#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.build.io            import DDROutput
from litex.soc.cores.code_tmds import TMDSEncoder
from litex.soc.cores.video     import video_data_layout
from litex.soc.interconnect    import stream

# HDMI PHY -----------------------------------------------------------------------------------------

class HDMIPHY(LiteXModule):
    """As LiteX's VideoHDMIPHY, with a register in front of each pin: its gearbox alone takes most of a clock of 8 ns.

    Parameters
    ----------
    pads
        `clk_p`, and `data0_p` to `data2_p` for blue, green and red.
    clock_domain : str
        Of pixels; that of their bits, two in each clock, has the same name with `5x` behind it.
    """
    def __init__(self, pads, clock_domain):
        self.sink = sink = stream.Endpoint(video_data_layout)

        # # #

        # A monitor does not wait.
        self.comb += sink.ready.eq(1)
        self.specials += DDROutput(1, 0, pads.clk_p, ClockSignal(clock_domain))
        for channel, color in enumerate(("b", "g", "r")):
            encoder = ClockDomainsRenamer(clock_domain)(TMDSEncoder())
            self.add_module(name=f"{color}_encoder", module=encoder)
            self.comb += [
                encoder.d.eq(getattr(sink, color)),
                encoder.c.eq(Cat(sink.hsync, sink.vsync) if channel == 0 else 0),
                encoder.de.eq(sink.de),
            ]
            self.add_serializer(encoder.out, getattr(pads, f"data{channel}_p"), clock_domain, f"{clock_domain}5x")

    def add_serializer(self, data, pad, clock_domain, fast_domain):
        """Ten bits in each clock of the pixels, the lowest first."""
        crossing = stream.ClockDomainCrossing([("data", 10)], cd_from=clock_domain, cd_to=fast_domain)
        gearbox  = ClockDomainsRenamer(fast_domain)(stream.Gearbox(i_dw=10, o_dw=2, msb_first=False))
        register = ClockDomainsRenamer(fast_domain)(stream.Buffer([("data", 2)]))
        bits     = register.source.data
        self.submodules += crossing, gearbox, register
        self.comb += [
            crossing.sink.valid.eq(1),
            crossing.sink.data.eq(data),
            crossing.source.connect(gearbox.sink),
            gearbox.source.connect(register.sink),
            register.source.ready.eq(1),
        ]
        self.specials += DDROutput(bits[0], bits[1], pad, ClockSignal(fast_domain))
