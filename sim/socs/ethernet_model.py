#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common import eth_phy_description

# Ethernet PHY Model -------------------------------------------------------------------------------

class EthernetPHYModel(LiteXModule):
    """PHY of the simulation: a byte per clock of the wire, without preamble and CRC; a frame is a row of valid bytes.

    Like LiteEthPHYModel, but with a clock apart from the system's, as a real wire has. The reset of `sys` resets both
    sides of the clock crossings, as they require.
    """
    dw                = 8
    with_preamble_crc = False

    def __init__(self, clock, pads):
        self.sink   = sink   = stream.Endpoint(eth_phy_description(8))
        self.source = source = stream.Endpoint(eth_phy_description(8))
        self.cd_eth_rx = ClockDomain()
        self.cd_eth_tx = ClockDomain()

        # # #

        self.comb += [
            self.cd_eth_rx.clk.eq(clock),
            self.cd_eth_tx.clk.eq(clock),
            self.cd_eth_rx.rst.eq(ResetSignal("sys")),
            self.cd_eth_tx.rst.eq(ResetSignal("sys")),
            pads.source_valid.eq(sink.valid),
            pads.source_data.eq(sink.data),
            sink.ready.eq(1),
            pads.sink_ready.eq(1),
            source.last.eq(source.valid & ~pads.sink_valid),
        ]
        self.sync.eth_rx += [
            source.valid.eq(pads.sink_valid),
            source.data.eq(pads.sink_data),
        ]
