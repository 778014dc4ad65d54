#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Digilent Atlys with an XC6SLX45: 128 MB of DDR2 at 16 bits.

The board of Citron's thesis of 2014; ISE makes the bitstream.
"""

from litedram.modules import MT47H64M16
from litedram.phy     import S6HalfRateDDRPHY

from litex_boards.platforms.digilent_atlys import Platform
from litex_boards.targets.digilent_atlys   import _CRG

from ..parts.flash_pads import FlashPads
from .board_soc         import BoardSoC
from .preset            import Preset

# Clocks -------------------------------------------------------------------------------------------

class AtlysCRG(_CRG):
    def __init__(self, platform, sys_clk_freq):
        _CRG.__init__(self, platform, sys_clk_freq)
        self.rst = self.reset # Driven by the SoC's reset register.

# SoC ----------------------------------------------------------------------------------------------

class Atlys(BoardSoC):
    board_name    = "atlys"
    loader        = None # openFPGALoader does not know it.
    family        = "Spartan-6"
    build_options = {}
    rom_bytes     = 16*1024
    memory_module = MT47H64M16
    memory_bits   = 16
    memory_rate   = "1:2"
    preset        = Preset(
        disparities    = 64,
        max_block_size = 9,
        sys_clk_freq   = 75000000,
    )

    def make_platform(self):
        return Platform()

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = AtlysCRG(platform, sys_clk_freq)

    def make_memory_phy(self, module):
        self.ddrphy = S6HalfRateDDRPHY(self.platform.request("ddram"), memtype="DDR2", rd_bitslip=0, wr_bitslip=4,
            dqs_ddr_alignment="C0")
        self.comb += [
            self.ddrphy.clk4x_wr_strb.eq(self.crg.clk4x_wr_strb),
            self.ddrphy.clk4x_rd_strb.eq(self.crg.clk4x_rd_strb),
        ]
        return self.ddrphy

    def make_flash_pads(self):
        return FlashPads(self.platform.request("spiflash4x"))
