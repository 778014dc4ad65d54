#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The SoC in litex_sim: on integrated RAM, or on LiteDRAM's model of the Colorlight i5's SDRAM."""

import json
import os
import shutil
import sys
from functools import partial

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from litex.build.generic_platform import Pins, Subsignal
from litex.build.sim              import SimPlatform
from litex.build.sim.config       import SimConfig
from litex.soc.cores.bitbang      import SPIMaster
from litex.soc.integration.soc    import SoCRegion

from litedram.core.controller import ControllerSettings
from litedram.modules         import M12L64322A
from litedram.phy.model       import SDRAMPHYModel

from ...gateware.cameras.parameters import CameraParameters
from ...soc.boards.board_soc        import FLASH_RECORDS_BYTES
from ...soc.build.builder           import StereoBuilder
from ...soc.parts.stereo_soc        import StereoSoC
from ...soc.parts.wide_ram          import WideRAM
from .ethernet_model                import EthernetPHYModel
from .flash_model                   import FlashModel, SECTOR_BYTES, flash_model_bytes
from .matcher                       import CAMERA_MATCHER, MATCHER, RECTIFYING_MATCHER
from .memory_monitor                import EVENTS, MemoryMonitor
from .simulator                     import build_simulator

MAIN_RAM_BYTES = 8*1024*1024 # The size of a Colorlight i5's SDRAM.
FLASH_ORIGIN   = 0x3000_0000
FLASH_BYTES    = 256*1024

# A simulated second is a million clocks, so that the firmware's timeouts, in seconds, fit the pace of the simulation.
SYS_CLK_FREQ = int(1e6)
RESET_CLOCKS = 64

# Frequency of a separate matcher clock. The simulator steps at each multiple of the greatest common divisor of all
# half periods.
MATCHER_CLK_FREQ = 2*SYS_CLK_FREQ

# Pads of a byte stream in each direction, as litex_sim's modules name them.
BYTES = [Subsignal(f"{side}_{name}", Pins(bits)) for side in ("source", "sink")
    for name, bits in [("valid", 1), ("ready", 1), ("data", 8)]]

IO = [
    ("sys_clk", 0, Pins(1)),
    ("sys_rst", 0, Pins(1)),
    ("matcher_clk", 0, Pins(1)),
    ("serial",  0, *BYTES),
    ("eth_clk", 0, Pins(1)),
    ("eth",     0, *BYTES),
    ("video",   0, *(Subsignal(name, Pins(1)) for name in ("clk", "de", "hsync", "vsync")),
        *(Subsignal(name, Pins(8)) for name in ("r", "g", "b"))),
    ("memory",  0, Subsignal("events", Pins(EVENTS))),
]

# Clock --------------------------------------------------------------------------------------------

class SimulatedCRG(LiteXModule):
    """The simulator's clock, with a reset at power-up and on `rst`, long enough for the wire's clock domain."""
    def __init__(self, clk):
        self.rst    = Signal() # Driven by the SoC's reset register and its watchdog.
        self.cd_sys = ClockDomain()
        self.cd_por = ClockDomain(reset_less=True)

        # # #

        count = Signal(max=RESET_CLOCKS, reset=RESET_CLOCKS - 1)
        self.sync.por += If(self.rst, count.eq(RESET_CLOCKS - 1)).Elif(count != 0, count.eq(count - 1))
        self.comb += [
            self.cd_sys.clk.eq(clk),
            self.cd_por.clk.eq(clk),
            self.cd_sys.rst.eq(count != 0),
        ]

    def add_matcher(self, clk):
        """Give the matcher a separate clock; the reset of `sys` resets it too, for some clocks longer."""
        self.cd_matcher = ClockDomain()
        self.specials += MultiReg(self.cd_sys.rst, self.cd_matcher.rst, "matcher")
        self.comb     += self.cd_matcher.clk.eq(clk)

# Simulated SoCs -----------------------------------------------------------------------------------

class SimulatedSoC(StereoSoC):
    """What both simulated SoCs share: clocks from the simulator, and UART and Ethernet as byte streams."""
    def __init__(self, name, **kwargs):
        StereoSoC.__init__(self, SimPlatform("SIM", IO), SYS_CLK_FREQ, name=name, uart_name="sim", **kwargs)
        self.comb += self.platform.trace.eq(0)
        self.memory_monitor = MemoryMonitor(self, self.platform.request("memory").events)

    def add_clocking(self, platform, sys_clk_freq):
        self.crg = SimulatedCRG(platform.request("sys_clk"))

    def add_link(self):
        self.ethphy = EthernetPHYModel(self.platform.request("eth_clk"), self.platform.request("eth"))
        self.add_frame_link(self.ethphy, memory=self.memory, burst_bytes=self.burst_bytes)

    @staticmethod
    def sim_config():
        """Return the configuration of litex_sim: the clocks, and the UART and Ethernet on sockets."""
        config = SimConfig()
        config.add_clocker("sys_clk", freq_hz=SYS_CLK_FREQ)
        config.add_clocker("eth_clk", freq_hz=SYS_CLK_FREQ)
        config.add_module("serial2socket", "serial")
        config.add_module("ethernet2socket", "eth", clocks="eth_clk")
        config.add_module("memory2file", "memory")
        return config

class IntegratedRAMSoC(SimulatedSoC):
    """SoC with on-chip main memory, with a separate port for DMA; the CPU starts the firmware there, without BIOS."""
    def __init__(self, **kwargs):
        SimulatedSoC.__init__(self, "sim-ram",
            integrated_rom_size = 0,
            cpu_reset_address   = self.mem_map["main_ram"],
            **kwargs)
        # LiteX builds libraries only for SoCs with a ROM: build them here, but no BIOS.
        self.cpu.use_rom                = True
        self.integrated_rom_initialized = True

    def add_main_memory(self):
        # A first word makes the memory load its file, which holds the firmware.
        self.main_ram = WideRAM(MAIN_RAM_BYTES, init=[0])
        self.bus.add_slave("main_ram", self.main_ram.bus,
            SoCRegion(origin=self.mem_map["main_ram"], size=MAIN_RAM_BYTES, mode="rwx"))
        return self.main_ram

class RectifyingSoC(IntegratedRAMSoC):
    """SoC on integrated RAM that rectifies, with a flash for its calibration, which a reset leaves as it is."""
    def __init__(self, **kwargs):
        IntegratedRAMSoC.__init__(self, **kwargs)
        # The firmware knows a flash by its images, and is not started from this one.
        self.flash_bytes = flash_model_bytes(SECTOR_BYTES + FLASH_RECORDS_BYTES)
        self.flash_pads  = ClockDomainsRenamer("por")(FlashModel(self.flash_bytes))
        self.flash       = SPIMaster(self.flash_pads)
        for name, value in (
            ("FLASH_IMAGES",         1),
            ("FLASH_IMAGES_OFFSET",  0),
            ("FLASH_IMAGE_BYTES",    SECTOR_BYTES),
            ("FLASH_RECORDS_OFFSET", SECTOR_BYTES),
            ("FLASH_RECORDS_BYTES",  FLASH_RECORDS_BYTES),
        ):
            self.add_constant(name, value)

class CameraSoC(RectifyingSoC):
    """SoC on integrated RAM that rectifies, with cameras, whose test patterns take the places of sensors."""
    def add_link(self):
        self.add_cameras(CameraParameters(max_width=CAMERA_MATCHER.max_width, max_height=128, skew_pixels=256))
        RectifyingSoC.add_link(self)

class SDRAMSoC(SimulatedSoC):
    """SoC with SDRAM as main memory; LiteX's BIOS copies the firmware there from flash and starts it, as on a board."""
    def __init__(self, **kwargs):
        # Long bursts, because the chip changes its row after each.
        SimulatedSoC.__init__(self, "sim-sdram", integrated_rom_size=64*1024, burst_bytes=256, fast_ram_bytes=40*1024,
            **kwargs)

    def add_main_memory(self):
        # The chip's timing at 60 MHz, the clock of the board.
        module      = M12L64322A(int(60e6), "1:1")
        self.sdrphy = SDRAMPHYModel(module, data_width=32, clk_freq=int(60e6))
        # Turning the bus from reading to writing and back costs ten clocks: let each side finish its burst.
        settings = ControllerSettings(read_time=256, write_time=128)
        self.add_sdram("sdram", phy=self.sdrphy, module=module, size=MAIN_RAM_BYTES, l2_cache_size=0,
            controller_settings=settings)
        # A short memory test: each word costs seconds of simulation.
        self.add_constant("MEMTEST_DATA_SIZE", 4*1024)
        self.add_constant("MEMTEST_ADDR_SIZE", 4*1024)
        self.add_ram("flash", origin=FLASH_ORIGIN, size=FLASH_BYTES, contents=[0], mode="rx")
        self.add_constant("FLASH_BOOT_ADDRESS", FLASH_ORIGIN)
        return self.sdram.crossbar

SOCS = {
    "integrated-ram": partial(IntegratedRAMSoC, parameters=MATCHER),
    "sdram":          partial(SDRAMSoC, parameters=MATCHER),
    "sdram-lines":    partial(SDRAMSoC, parameters=MATCHER, with_line_reader=True),
    "rectifying":     partial(RectifyingSoC, parameters=RECTIFYING_MATCHER),
    "cameras":        partial(CameraSoC, parameters=CAMERA_MATCHER),
}

# Build --------------------------------------------------------------------------------------------

def generate(memory, output_dir, modules_dir):
    """Write the sources of a simulator and build the libraries for its firmware; return the folder of its gateware.

    Parameters
    ----------
    memory : str
        Key of `SOCS`.
    output_dir : str
        LiteX's output folder.
    modules_dir : str
        Sources of this project's litex_sim modules.
    """
    soc     = SOCS[memory]()
    builder = StereoBuilder(soc, output_dir, bios=not soc.integrated_rom_initialized)
    # LiteX writes a makefile into the folder of additional modules: give it a copy of that folder.
    modules_copy = os.path.join(output_dir, "modules")
    shutil.copytree(modules_dir, modules_copy)
    builder.build(
        run             = False,
        sim_config      = soc.sim_config(),
        interactive     = False,
        extra_mods      = ["serial2socket", "ethernet2socket", "memory2file"],
        extra_mods_path = modules_copy,
        opt_level       = "O3",
    )
    soc.memory_monitor.write_names(output_dir)
    if hasattr(soc, "flash_bytes"):
        with open(os.path.join(output_dir, "flash.json"), "w") as file:
            json.dump({"bytes": soc.flash_bytes}, file)
    return builder.gateware_dir

if __name__ == "__main__":
    memory, output_dir, modules_dir, *options = sys.argv[1:]
    gateware_dir = generate(memory, output_dir, modules_dir)
    if options != ["--no-simulator"]:
        build_simulator(gateware_dir)
