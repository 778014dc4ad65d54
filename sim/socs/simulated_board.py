#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A board's SoC in litex_sim: its preset, kind and width of RAM, and boot from flash; pins and clocks are simulated."""

import json
import os
import shutil
import sys

from migen import ClockDomainsRenamer

from litex.build.sim import SimPlatform

from litedram.phy.model import SDRAMPHYModel

from ...soc.boards           import soc_class
from ...soc.boards.board_soc import BoardSoC, PIXEL_DOMAIN, PIXEL_HZ
from ...soc.build.builder    import StereoBuilder
from .ethernet_model         import EthernetPHYModel
from .flash_model            import FlashModel, flash_model_bytes
from .memory_monitor         import MemoryMonitor
from .simulated_soc          import IO, MATCHER_CLK_FREQ, SYS_CLK_FREQ, SimulatedCRG, SimulatedSoC
from .simulator              import build_simulator
from .video_model            import VideoPHYModel

# Simulated Board ----------------------------------------------------------------------------------

def simulated(board):
    """Return the class of a board's simulated SoC."""
    base = soc_class(board)

    class SimulatedBoard(base):
        def __init__(self):
            base.__init__(self, base.preset, SimPlatform("SIM", IO), SYS_CLK_FREQ, uart_name="sim")
            self.comb += self.platform.trace.eq(0)
            self.memory_monitor = MemoryMonitor(self, self.platform.request("memory").events)

        def add_clocking(self, platform, sys_clk_freq):
            self.crg = SimulatedCRG(platform.request("sys_clk"))
            if self.preset.matcher_hz:
                self.crg.add_matcher(platform.request("matcher_clk"))

        def make_memory_phy(self, module):
            self.sdrphy = SDRAMPHYModel(module, data_width=base.memory_bits, clk_freq=self.preset.sys_clk_freq)
            return self.sdrphy

        def make_ethernet_phy(self):
            # The simulator's module needs its pads even if the board has no Ethernet.
            pads = self.platform.request("eth_clk"), self.platform.request("eth")
            return EthernetPHYModel(*pads) if base.make_ethernet_phy is not BoardSoC.make_ethernet_phy else None

        def make_video_phy(self):
            # As many clocks per pixel as on the board, so that the frame buffer reads memory at the same rate.
            return VideoPHYModel(self.platform.request("video"), PIXEL_DOMAIN,
                round(self.preset.sys_clk_freq/PIXEL_HZ))

        def make_flash_pads(self):
            # A reset of the SoC does not reset the flash.
            return ClockDomainsRenamer("por")(FlashModel(flash_model_bytes(
                self.flash_images*self.flash_image_bytes + self.flash_records_bytes)))

        @staticmethod
        def sim_config():
            """Return the configuration of litex_sim; a screen's pictures go to a file."""
            config = SimulatedSoC.sim_config()
            if base.preset.matcher_hz:
                config.add_clocker("matcher_clk", freq_hz=MATCHER_CLK_FREQ)
            if base.preset.with_screen:
                config.add_module("video2file", "video")
            return config

    return SimulatedBoard

# Build --------------------------------------------------------------------------------------------

def build(board, output_dir, modules_dir):
    """Build the simulator and the libraries of a board; see `soc.simulation.build`."""
    soc          = simulated(board)()
    builder      = StereoBuilder(soc, output_dir)
    modules_copy = os.path.join(output_dir, "modules")
    shutil.copytree(modules_dir, modules_copy)
    builder.build(
        run             = False,
        sim_config      = soc.sim_config(),
        interactive     = False,
        extra_mods      = ["serial2socket", "ethernet2socket", "memory2file", "video2file"],
        extra_mods_path = modules_copy,
        opt_level       = "O3",
    )
    soc.memory_monitor.write_names(output_dir)
    with open(os.path.join(output_dir, "board.json"), "w") as file:
        json.dump({"rom": soc.rom_bytes, "flash": {"bytes": soc.flash_image_bytes, "images": soc.flash_images,
            "records": soc.flash_records_bytes}}, file)
    build_simulator(builder.gateware_dir)

if __name__ == "__main__":
    build(*sys.argv[1:])
