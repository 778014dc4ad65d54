#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.cores.bitbang import SPIMaster

from ..stereo_soc import StereoSoC

ROM_BYTES  = 4*1024 # Of the boot program.
SRAM_BYTES = 4*1024 # Stack.

# Images of the firmware in flash: the boot program starts the first good one.
FLASH_IMAGES      = 2
FLASH_IMAGE_BYTES = 256*1024

# Flash Pads ---------------------------------------------------------------------------------------

class ECP5FlashPads(LiteXModule):
    """The pads of the configuration flash as `SPIMaster` wants them; an ECP5 has that clock at a primitive, not at a pin."""
    def __init__(self, pads):
        self.clk  = Signal()
        self.cs_n = pads.cs_n
        self.mosi = pads.mosi
        self.miso = pads.miso

        # # #

        self.specials += Instance("USRMCLK", i_USRMCLKI=self.clk, i_USRMCLKTS=0)
        for name in ("wp", "hold"):
            if hasattr(pads, name):
                self.comb += getattr(pads, name).eq(1)

# Board SoC ----------------------------------------------------------------------------------------

class BoardSoC(StereoSoC):
    """What the SoCs of all boards share: a boot program in ROM instead of LiteX's BIOS, and the flash that it reads.

    Parameters
    ----------
    platform
        LiteX platform of the board.
    preset : Preset
        What is built.
    name : str
        Of the board.
    rom_bytes : int
        Size of the boot program's ROM.
    **kwargs
        Passed on to `StereoSoC`.
    """
    flash_offset      = 4*1024*1024 # Of the firmware's images, behind the largest bitstream.
    flash_images      = FLASH_IMAGES
    flash_image_bytes = FLASH_IMAGE_BYTES

    def __init__(self, platform, preset, name, rom_bytes=ROM_BYTES, **kwargs):
        self.preset    = preset
        self.rom_bytes = rom_bytes
        soc_kwargs = dict(
            cpu_variant          = preset.cpu_variant,
            uart_baudrate        = 1000000,
            integrated_sram_size = SRAM_BYTES,
            integrated_rom_size  = rom_bytes,
            # First contents, for the memory to load its file; the boot program comes in there.
            integrated_rom_init  = [0],
        )
        soc_kwargs.update(kwargs)
        StereoSoC.__init__(self, platform, preset.sys_clk_freq,
            name           = name,
            max_width      = preset.max_width,
            disparities    = preset.disparities,
            max_block_size = preset.max_block_size,
            features       = preset.features,
            burst_bytes    = preset.burst_bytes,
            **soc_kwargs)
        self.add_flash()

    def add_flash(self):
        """The flash of bitstream and firmware, at pins that the firmware drives itself: it is read once."""
        self.flash_pads = ECP5FlashPads(self.platform.request("spiflash"))
        self.flash      = SPIMaster(self.flash_pads)
        self.add_constant("FLASH_IMAGES",        self.flash_images)
        self.add_constant("FLASH_IMAGES_OFFSET", self.flash_offset)
        self.add_constant("FLASH_IMAGE_BYTES",   self.flash_image_bytes)
        # The boot program starts the memory and does not test it: the firmware's checksum is taken from there.
        self.add_constant("SDRAM_TEST_DISABLE")

    def add_ethernet(self, phy):
        """Add the frame link behind a PHY.

        LiteEth's PHYs hold the clock domains of the wire in reset while `sys` is, and for a while longer: the counter that
        does it is in `sys`. So both sides of the crossings are in reset at once, and the crossings are empty after it.
        """
        self.ethphy = phy
        self.add_frame_link(phy, memory=self.memory, burst_bytes=self.burst_bytes, with_icmp=self.preset.with_icmp)
