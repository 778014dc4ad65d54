#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What Colorlight i5 and i9 share: ECP5, 8 MB of SDRAM at 32 bits, gigabit Ethernet."""

from migen import *

from litex.gen import *

from litex.build.io        import DDROutput
from litex.soc.cores.clock import ECP5PLL

from litedram.modules import M12L64322A
from litedram.phy     import GENSDRPHY

from liteeth.phy.ecp5rgmii import LiteEthPHYRGMII

from litex_boards.platforms.colorlight_i5 import Platform

from .board_soc import BoardSoC, SDR_SETTINGS

# Clocks -------------------------------------------------------------------------------------------

class ColorlightCRG(LiteXModule):
    def __init__(self, platform, sys_clk_freq):
        self.rst       = Signal() # Driven by the SoC's reset register.
        self.cd_sys    = ClockDomain()
        self.cd_sys_ps = ClockDomain()

        # # #

        self.pll = pll = ECP5PLL()
        self.comb += pll.reset.eq(~platform.request("cpu_reset_n") | self.rst)
        pll.register_clkin(platform.request("clk25"), 25e6)
        pll.create_clkout(self.cd_sys,    sys_clk_freq)
        pll.create_clkout(self.cd_sys_ps, sys_clk_freq, phase=180)
        self.specials += DDROutput(1, 0, platform.request("sdram_clock"), ClockSignal("sys_ps"))

# SoC ----------------------------------------------------------------------------------------------

class ColorlightSoC(BoardSoC):
    """Either board; a target sets `board` and `revision` as litex-boards knows them, and `preset`."""
    memory_module   = M12L64322A
    memory_settings = SDR_SETTINGS

    def make_platform(self):
        return Platform(board=self.board, revision=self.revision)

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = ColorlightCRG(platform, sys_clk_freq)

    def make_memory_phy(self, module):
        self.sdrphy = GENSDRPHY(self.platform.request("sdram"), self.sys_clk_freq)
        return self.sdrphy

    def make_ethernet_phy(self):
        return LiteEthPHYRGMII(self.platform.request("eth_clocks"), self.platform.request("eth"), tx_delay=0)
