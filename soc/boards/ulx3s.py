#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Radiona ULX3S with an LFE5U-85F: 32 MB of SDRAM at 16 bits, a serial line over USB, HDMI."""

from migen import *

from litex.gen import *

from litex.build.io        import DDROutput
from litex.soc.cores.clock import ECP5PLL

from litedram.modules import AS4C32M16
from litedram.phy     import GENSDRPHY

from litex_boards.platforms.radiona_ulx3s import Platform

from ..parts.hdmi_phy import HDMIPHY
from .board_soc       import BoardSoC, PIXEL_DOMAIN, PIXEL_HZ, SDR_SETTINGS
from .preset          import Preset

# Clocks -------------------------------------------------------------------------------------------

class ULX3SCRG(LiteXModule):
    def __init__(self, platform, sys_clk_freq, with_screen):
        self.rst       = Signal() # Driven by the SoC's reset register.
        self.cd_sys    = ClockDomain()
        self.cd_sys_ps = ClockDomain()

        # # #

        rst   = platform.request("rst")
        clk25 = platform.request("clk25")
        self.pll = pll = ECP5PLL()
        self.comb += pll.reset.eq(rst | self.rst)
        pll.register_clkin(clk25, 25e6)
        pll.create_clkout(self.cd_sys,    sys_clk_freq)
        pll.create_clkout(self.cd_sys_ps, sys_clk_freq, phase=90)
        if with_screen:
            self.add_video(clk25, rst)
        self.specials += DDROutput(1, 0, platform.request("sdram_clock"), ClockSignal("sys_ps"))
        # Low, this pin switches the board off.
        self.comb += platform.request("wifi_gpio0").eq(1)

    def add_video(self, clk25, rst):
        """Add a separate PLL, so that the clocks of system and memory are as without a screen."""
        self.cd_hdmi   = ClockDomain() # Of pixels,
        self.cd_hdmi5x = ClockDomain() # and of their bits, two a clock.
        self.video_pll = video_pll = ECP5PLL()
        self.comb += video_pll.reset.eq(rst | self.rst)
        video_pll.register_clkin(clk25, 25e6)
        video_pll.create_clkout(self.cd_hdmi,   PIXEL_HZ,   margin=0)
        video_pll.create_clkout(self.cd_hdmi5x, 5*PIXEL_HZ, margin=0)

# SoC ----------------------------------------------------------------------------------------------

class ULX3S(BoardSoC):
    board_name      = "ulx3s"
    loader          = "ulx3s"
    uart_baudrate   = 3000000
    memory_module   = AS4C32M16
    memory_bits     = 16
    memory_settings = SDR_SETTINGS
    preset          = Preset(
        disparities    = 128,
        max_block_size = 15,
        sys_clk_freq   = 62500000,
        with_screen    = True,
        seed           = 2,
    )

    def make_platform(self):
        return Platform(device="LFE5U-85F")

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = ULX3SCRG(platform, sys_clk_freq, self.preset.with_screen)

    def make_memory_phy(self, module):
        self.sdrphy = GENSDRPHY(self.platform.request("sdram"), self.sys_clk_freq)
        return self.sdrphy

    def make_video_phy(self):
        return HDMIPHY(self.platform.request("gpdi"), PIXEL_DOMAIN)
