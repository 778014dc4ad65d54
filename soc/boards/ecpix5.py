#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""LambdaConcept ECPIX-5 with an LFE5UM5G-85F or -45F: 512 MB of DDR3 at 16 bits, gigabit Ethernet."""

from migen import *
from migen.genlib.resetsync import AsyncResetSynchronizer

from litex.gen import *

from litex.soc.cores.clock import ECP5PLL

from litedram.modules import MT41K256M16
from litedram.phy     import ECP5DDRPHY

from liteeth.phy.ecp5rgmii import LiteEthPHYRGMII

from litex_boards.platforms.lambdaconcept_ecpix5 import Platform

from .board_soc import BoardSoC, SDR_SETTINGS
from .preset    import Preset

# Clocks -------------------------------------------------------------------------------------------

class ECPIX5CRG(LiteXModule):
    """The clock of DDR3, twice the system's, is stopped and started by its PHY; the system's is derived from it.

    All domains are in reset until the board's supplies are stable, and again on `rst`.
    """
    def __init__(self, platform, sys_clk_freq, matcher_hz):
        self.rst        = Signal() # Driven by the SoC's reset register.
        self.stop       = Signal() # Of the PHY,
        self.reset      = Signal() # while it aligns its clocks.
        self.cd_init    = ClockDomain()
        self.cd_por     = ClockDomain(reset_less=True)
        self.cd_sys     = ClockDomain()
        self.cd_sys2x   = ClockDomain()
        self.cd_sys2x_i = ClockDomain()

        # # #

        clk100 = platform.request("clk100")
        wait   = Signal(16, reset=2**16 - 1) # Clocks until the board's supplies are stable.
        self.comb     += self.cd_por.clk.eq(clk100)
        self.sync.por += If(wait != 0, wait.eq(wait - 1))

        self.pll = pll = ECP5PLL()
        self.comb += pll.reset.eq((wait != 0) | ~platform.request("rst_n") | self.rst)
        pll.register_clkin(clk100, 100e6)
        pll.create_clkout(self.cd_sys2x_i, 2*sys_clk_freq)
        pll.create_clkout(self.cd_init, 25e6)
        self.specials += [
            Instance("ECLKSYNCB",
                i_ECLKI = self.cd_sys2x_i.clk,
                i_STOP  = self.stop,
                o_ECLKO = self.cd_sys2x.clk,
            ),
            Instance("CLKDIVF",
                p_DIV     = "2.0",
                i_ALIGNWD = 0,
                i_CLKI    = self.cd_sys2x.clk,
                i_RST     = self.reset,
                o_CDIVX   = self.cd_sys.clk,
            ),
            AsyncResetSynchronizer(self.cd_sys, ~pll.locked | self.reset),
        ]
        if matcher_hz:
            self.cd_matcher = ClockDomain()
            pll.create_clkout(self.cd_matcher, matcher_hz, with_reset=False)
            # After the system's reset: the system's side of the crossings must have been in reset for some clocks.
            self.specials += AsyncResetSynchronizer(self.cd_matcher, ResetSignal("sys"))

# SoC ----------------------------------------------------------------------------------------------

class ECPIX5(BoardSoC):
    board_name    = "ecpix5"
    loader        = "ecpix5"
    device        = "85F"
    rom_bytes     = 32*1024 # DDR3 needs training, so the boot program is larger.
    memory_module = MT41K256M16
    memory_bits   = 16
    memory_rate   = "1:2"
    matcher_clock = True
    # Turning DDR3's bus costs clocks as well.
    memory_settings = SDR_SETTINGS
    preset        = Preset(
        disparities    = 128,
        max_block_size = 15,
        sys_clk_freq   = 70000000,
        matcher_hz     = 100000000,
    )

    def make_platform(self):
        return Platform(device=self.device)

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = ECPIX5CRG(platform, sys_clk_freq, self.preset.matcher_hz)

    def make_memory_phy(self, module):
        self.ddrphy = ECP5DDRPHY(self.platform.request("ddram"), sys_clk_freq=self.sys_clk_freq)
        self.comb += [
            self.crg.stop.eq(self.ddrphy.init.stop),
            self.crg.reset.eq(self.ddrphy.init.reset),
        ]
        return self.ddrphy

    def make_ethernet_phy(self):
        return LiteEthPHYRGMII(self.platform.request("eth_clocks"), self.platform.request("eth"), rx_delay=0)
