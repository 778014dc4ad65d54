#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import wishbone

# Wide RAM -----------------------------------------------------------------------------------------

class WideRAM(LiteXModule):
    """On-chip RAM with two sides: one for the SoC's bus, one for DMA, both `data_width` bits wide.

    With a separate side the DMA neither waits for the CPU nor slows it down, and a wide word compensates for the two
    clocks of a classic Wishbone access. `get_port` returns DMA ports as LiteDRAM's crossbar does.
    """
    def __init__(self, size, data_width=128, init=None, name="main_ram"):
        memory      = Memory(data_width, size//(data_width//8), init=init, name=name)
        self.bus    = wishbone.Interface(data_width=data_width, address_width=32, addressing="word")
        self.dma    = wishbone.Interface(data_width=data_width, address_width=32, addressing="word")
        self.sides  = [wishbone.SRAM(memory, bus=self.bus), wishbone.SRAM(memory, bus=self.dma)]
        self.submodules += self.sides
        self.masters = []

    def get_port(self, mode="both"):
        """Return a new port of the DMA side; `mode` is "read", "write" or "both"."""
        port = wishbone.Interface(data_width=self.dma.data_width, address_width=32, addressing="word", mode={
            "read": "r", "write": "w", "both": "rw"}[mode])
        self.masters.append(port)
        return port

    def do_finalize(self):
        if self.masters:
            self.submodules += wishbone.Arbiter(self.masters, self.dma)
