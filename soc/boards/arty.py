#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Digilent Arty A7 with an XC7A35T or XC7A100T: 256 MB of DDR3 at 16 bits, Ethernet of 100 Mbit/s.

Vivado makes the bitstream.
"""

from litedram.modules import MT41K128M16
from litedram.phy     import A7DDRPHY

from liteeth.phy.mii import LiteEthPHYMII

from litex_boards.platforms.digilent_arty import Platform
from litex_boards.targets.digilent_arty   import _CRG as ArtyCRG

from ..parts.flash_pads import FlashPads
from .board_soc         import BoardSoC
from .preset            import Preset

class Arty(BoardSoC):
    board_name    = "arty"
    loader        = "arty_a7_35t"
    variant       = "a7-35"
    family        = "7-series"
    build_options = {}
    rom_bytes     = 32*1024 # DDR3 needs training, so the boot program is larger.
    memory_module = MT41K128M16
    memory_bits   = 16
    memory_rate   = "1:4"
    preset        = Preset(
        disparities    = 16,
        max_block_size = 9,
        # The memory's clock is four times as fast, and 300 MHz is the slowest that DDR3 supports.
        sys_clk_freq   = 80000000,
        streaming      = False,
        with_icmp      = False,
    )

    def make_platform(self):
        return Platform(variant=self.variant)

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = ArtyCRG(platform, sys_clk_freq)

    def make_memory_phy(self, module):
        self.ddrphy = A7DDRPHY(self.platform.request("ddram"), memtype="DDR3", nphases=4,
            sys_clk_freq=self.sys_clk_freq)
        return self.ddrphy

    def make_ethernet_phy(self):
        return LiteEthPHYMII(self.platform.request("eth_clocks"), self.platform.request("eth"))

    def make_flash_pads(self):
        return FlashPads(self.platform.request("spiflash"))
