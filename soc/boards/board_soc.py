#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.cores.bitbang import SPIMaster

from litedram.common          import LiteDRAMNativePort
from litedram.core.controller import ControllerSettings

from ...gateware.common.bus_register    import BusRegister
from ...gateware.common.parameters      import check
from ...gateware.common.stream_register import add_register
from ..parts.flash_pads                 import ECP5FlashPads
from ..parts.screen_arbiter             import ScreenArbiter
from ..parts.stereo_soc                 import StereoSoC

ROM_BYTES  = 4*1024 # Size of the boot program.
SRAM_BYTES = 4*1024 # Size of its stack.

# Up to this clock an ECP5 of speed grade 6 does not need the registers that cost LUTs.
UNPIPELINED_HZ = 60000000

# Turning the bus from reading to writing and back costs ten clocks: let each side finish its burst.
SDR_SETTINGS = ControllerSettings(read_time=256, write_time=128)

# Images of the firmware in flash: the boot program starts a valid one.
FLASH_IMAGES      = 2
FLASH_IMAGE_BYTES = 256*1024

# Records of the firmware in flash, after its images: eight kinds, two copies of 20 KiB each; see its `records.h`.
FLASH_RECORDS_BYTES = 8*2*20*1024

# Clock domain of a matcher with a separate clock.
MATCHER_DOMAIN = "matcher"

# Picture of a screen, and its pixel clock: monitors accept it in place of 25.175 MHz.
SCREEN_TIMINGS = "640x480@60Hz"
PIXEL_DOMAIN   = "hdmi"
PIXEL_HZ       = 25000000
# Bytes between memory and screen: 20 us of a picture; `ScreenArbiter` decides when they are filled.
SCREEN_FIFO_BYTES = 512

# Board SoC ----------------------------------------------------------------------------------------

class BoardSoC(StereoSoC):
    """What the SoCs of all boards share: a boot program in ROM instead of LiteX's BIOS, and the flash that it reads.

    A target sets class attributes, and overrides `make_platform`, `add_clocking`, `make_memory_phy`,
    `make_ethernet_phy` and `make_video_phy`.

    Parameters
    ----------
    preset : Preset
        What is built.
    platform
        LiteX platform instead of the board's own.
    sys_clk_freq : int
        System clock in Hz instead of the preset's; the memory's timing remains the preset's.
    **kwargs
        Passed on to `StereoSoC`.
    """
    board_name      = None # Name in `BOARDS`.
    loader          = None # Name in openFPGALoader.
    family          = "ECP5" # Family of the FPGA, as in `soc.synthesis`.
    build_options   = dict(nowidelut=True, timingstrict=True) # Of LiteX's toolchain; wide functions take LUTs in pairs.
    rom_bytes       = ROM_BYTES
    uart_baudrate   = 1000000
    memory_module   = None # LiteDRAM's class of the chip,
    memory_bits     = 32   # width of its bus,
    memory_rate     = "1:1"
    memory_settings = None # and settings of its controller.
    matcher_clock   = False # Whether the matcher can have a separate clock, in the domain `MATCHER_DOMAIN`.

    flash_offset      = 4*1024*1024 # Offset of the firmware's images, after the largest bitstream.
    flash_images      = FLASH_IMAGES
    flash_image_bytes = FLASH_IMAGE_BYTES
    flash_records_bytes = FLASH_RECORDS_BYTES

    def __init__(self, preset, platform=None, sys_clk_freq=None, **kwargs):
        check(self.matcher_clock or not preset.matcher_hz,
            f"the {self.board_name} has no clock for the matcher alone: leave out matcher_hz.")
        self.preset    = preset
        self.pipelined = self.csr_registers = preset.sys_clk_freq > UNPIPELINED_HZ
        soc_kwargs  = dict(
            cpu_variant          = preset.cpu_variant,
            uart_baudrate        = self.uart_baudrate,
            integrated_sram_size = SRAM_BYTES,
            integrated_rom_size  = self.rom_bytes,
            # With contents from the start, the memory loads its file, which holds the boot program.
            integrated_rom_init  = [0],
        )
        soc_kwargs.update(kwargs)
        StereoSoC.__init__(self, platform or self.make_platform(), sys_clk_freq or preset.sys_clk_freq,
            name                 = self.board_name,
            parameters           = preset.parameters,
            burst_bytes          = preset.burst_bytes,
            fast_ram_bytes       = preset.fast_ram_bytes,
            matcher_clock_domain = MATCHER_DOMAIN if preset.matcher_hz else "sys",
            **soc_kwargs)
        self.add_screen()
        self.add_bus_registers()
        if self.pipelined:
            self.add_memory_registers()
        self.add_flash()

    # What StereoSoC asks for ----------------------------------------------------------------------

    def add_main_memory(self):
        module = self.memory_module(self.preset.sys_clk_freq, self.memory_rate)
        # Without L2 cache: the matcher's ports bypass it, and it is slow.
        self.add_sdram("sdram", phy=self.make_memory_phy(module), module=module, l2_cache_size=0,
            controller_settings=self.memory_settings or ControllerSettings())
        # The boot program starts the memory and does not test it: the firmware's checksum is computed there.
        self.add_constant("SDRAM_TEST_DISABLE")
        return self.sdram.crossbar

    def add_link(self):
        """Add the frame link, if the board has Ethernet.

        LiteEth's PHYs hold the wire's clock domains in reset while `sys` is, and for some clocks longer: the counter is
        in `sys`. Without a cable the wire's clock may be stopped meanwhile: `CrossingReset` waits for it.
        """
        phy = self.make_ethernet_phy()
        if phy is not None:
            self.ethphy = phy
            self.add_frame_link(phy,
                memory      = self.memory,
                burst_bytes = self.burst_bytes,
                streaming   = self.preset.streaming,
                with_icmp   = self.preset.with_icmp,
                pipelined   = self.pipelined,
            )

    def add_screen(self):
        """Add the frame buffer of a screen, if the preset has one: grey, a byte per pixel, anywhere in memory."""
        if self.preset.with_screen:
            phy = self.make_video_phy()
            check(phy is not None, f"the {self.board_name} has no connector for a screen: leave out with_screen.")
            self.videophy = phy
            # LiteX would otherwise give it a separate region inside the main memory.
            self.mem_map = {**self.mem_map, "video_framebuffer": self.mem_map["main_ram"]}
            self.add_video_framebuffer(
                phy          = phy,
                timings      = SCREEN_TIMINGS,
                clock_domain = PIXEL_DOMAIN,
                format       = "mono8",
                fifo_depth   = SCREEN_FIFO_BYTES,
            )
            dma     = self.video_framebuffer.dma
            masters = self.sdram.crossbar.masters
            self.screen_arbiter = ScreenArbiter(dma, SCREEN_FIFO_BYTES*8//dma.port.data_width)
            for number, port in enumerate(masters):
                masters[number] = self.screen_arbiter.add_gate(port, is_screen=port is dma.port)

    def add_bus_registers(self):
        """Add a register between the bus and each port of the CPU."""
        for name, master in self.bus.masters.items():
            if name.startswith("cpu_bus"):
                register = BusRegister(master)
                self.add_module(name=f"{name}_register", module=register)
                self.bus.masters[name] = register.bus

    def add_memory_registers(self):
        """Add a register between each port of LiteDRAM's crossbar and its commands: the clock that selects a bank
        and waits for it decides nothing else."""
        masters = self.sdram.crossbar.masters
        for number, port in enumerate(masters):
            inner = masters[number] = LiteDRAMNativePort(port.mode, port.address_width, port.data_width, id=port.id)
            add_register(self, port.cmd, inner.cmd)
            self.comb += [
                port.wdata.connect(inner.wdata),
                inner.rdata.connect(port.rdata),
                inner.flush.eq(port.flush),
                port.lock.eq(inner.lock),
            ]

    def add_flash(self):
        """Add the flash of bitstream and firmware, at pins that the CPU drives: read once, written by updates."""
        self.flash_pads = self.make_flash_pads()
        self.flash      = SPIMaster(self.flash_pads)
        self.add_constant("FLASH_IMAGES",        self.flash_images)
        self.add_constant("FLASH_IMAGES_OFFSET", self.flash_offset)
        self.add_constant("FLASH_IMAGE_BYTES",   self.flash_image_bytes)
        self.add_constant("FLASH_RECORDS_OFFSET", self.flash_records_offset)
        self.add_constant("FLASH_RECORDS_BYTES",  self.flash_records_bytes)

    @property
    def flash_records_offset(self):
        """Return the address of the firmware's records, which follow the images without a gap."""
        return self.flash_offset + self.flash_images*self.flash_image_bytes

    # Hooks ----------------------------------------------------------------------------------------

    def make_platform(self):
        """Return the LiteX platform of the board."""
        raise NotImplementedError

    def make_memory_phy(self, module):
        """Return the PHY of the main memory, a module of this SoC."""
        raise NotImplementedError

    def make_ethernet_phy(self):
        """Return the LiteEth PHY, 8 bits wide; None, as here, if the board has no Ethernet."""

    def make_video_phy(self):
        """Return the LiteX video PHY for `SCREEN_TIMINGS` in `PIXEL_DOMAIN`; None, as here, without a screen."""

    def make_flash_pads(self):
        """Return the pads of the flash as `SPIMaster` wants them, a module."""
        return ECP5FlashPads(self.platform.request("spiflash"))
