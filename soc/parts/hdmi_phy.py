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

# Serializer ---------------------------------------------------------------------------------------

class Serializer(LiteXModule):
    """Ten bits in five clocks, two per clock: a shift register, because LiteX's gearbox takes most of a clock of 8 ns.

    It is reset with its clock domain, which may truncate a word.
    """
    def __init__(self):
        self.sink = sink = stream.Endpoint([("data", 10)]) # A word, least significant bit first.
        self.bits = bits = Signal(2)                       # The lower bit is sent first.

        # # #

        remaining = Signal(max=5) # Bit pairs queued after `bits`.
        shift     = Signal(10)
        self.comb += [
            sink.ready.eq(remaining == 0),
            bits.eq(shift[:2]),
        ]
        self.sync += [
            shift.eq(shift[2:]),
            remaining.eq(remaining - 1),
            If(remaining == 0,
                # If one word comes in time, all do: the other side also has one in five clocks.
                shift.eq(sink.data),
                remaining.eq(4),
            ),
        ]

# HDMI Channel -------------------------------------------------------------------------------------

class HDMIChannel(LiteXModule):
    """One colour, encoded and serialized.

    Parameters
    ----------
    clock_domain : str
        Of pixels; that of their bits, two in each clock, has the same name with `5x` behind it.
    """
    def __init__(self, clock_domain):
        self.encoder    = encoder    = ClockDomainsRenamer(clock_domain)(TMDSEncoder())
        self.crossing   = crossing   = stream.ClockDomainCrossing([("data", 10)], clock_domain, f"{clock_domain}5x")
        self.serializer = serializer = ClockDomainsRenamer(f"{clock_domain}5x")(Serializer())

        # # #

        self.comb += [
            crossing.sink.valid.eq(1),
            crossing.sink.data.eq(encoder.out),
            crossing.source.connect(serializer.sink),
        ]

# HDMI PHY -----------------------------------------------------------------------------------------

class HDMIPHY(LiteXModule):
    """As LiteX's VideoHDMIPHY, for a faster clock.

    Parameters
    ----------
    pads
        `clk_p`, and `data0_p` to `data2_p` for blue, green and red.
    clock_domain : str
        Of pixels; that of their bits, two in each clock, has the same name with `5x` behind it.
    """
    def __init__(self, pads, clock_domain):
        self.sink = sink = stream.Endpoint(video_data_layout) # Pixels with their sync.

        # # #

        # A monitor does not wait.
        self.comb += sink.ready.eq(1)
        self.specials += DDROutput(1, 0, pads.clk_p, ClockSignal(clock_domain))
        for number, color in enumerate(("b", "g", "r")):
            channel = HDMIChannel(clock_domain)
            self.add_module(name=f"{color}_channel", module=channel)
            self.comb += [
                channel.encoder.d.eq(getattr(sink, color)),
                channel.encoder.c.eq(Cat(sink.hsync, sink.vsync) if number == 0 else 0),
                channel.encoder.de.eq(sink.de),
            ]
            pad = getattr(pads, f"data{number}_p")
            self.specials += DDROutput(*channel.serializer.bits, pad, ClockSignal(f"{clock_domain}5x"))
