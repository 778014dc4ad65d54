#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Sipeed Tang Primer 20K with a GW2A-18: 128 MB of DDR3 at 16 bits. Gowin's tool makes the bitstream."""

from litedram.modules import MT41K64M16
from litedram.phy     import GW2DDRPHY

from litex_boards.platforms.sipeed_tang_primer_20k import Platform
from litex_boards.targets.sipeed_tang_primer_20k   import _CRG as TangPrimer20kCRG

from ..parts.flash_pads import FlashPads
from .board_soc         import BoardSoC
from .preset            import Preset

class TangPrimer20k(BoardSoC):
    board_name    = "tang_primer_20k"
    loader        = "tangprimer20k"
    family        = "Gowin"
    flash_offset  = 2*1024*1024 # Of 4 MiB.
    build_options = {}
    rom_bytes     = 32*1024 # DDR3 needs training, so the boot program is larger.
    memory_module = MT41K64M16
    memory_bits   = 16
    memory_rate   = "1:2"
    preset        = Preset(
        disparities    = 16,
        max_block_size = 9,
        max_width      = 512, # Wider images need more block RAM than there is.
        sys_clk_freq   = 48000000,
    )

    def make_platform(self):
        return Platform()

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = TangPrimer20kCRG(platform, sys_clk_freq)

    def make_memory_phy(self, module):
        self.ddrphy = GW2DDRPHY(self.platform.request("ddram"), sys_clk_freq=self.sys_clk_freq)
        self.ddrphy.settings.rtt_nom = "disabled"
        self.comb += [
            self.crg.stop.eq(self.ddrphy.init.stop),
            self.crg.reset.eq(self.ddrphy.init.reset),
        ]
        return self.ddrphy

    def make_flash_pads(self):
        return FlashPads(self.platform.request("spiflash"))
