#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.integration.soc_core import SoCCore

from ...gateware.memory.line_reader import LineReader
from .add_cameras                   import CamerasMixin
from .add_frame_link                import FrameLinkMixin
from .add_stereo                    import StereoMixin
from .csr_registers                 import CSRRegistersMixin
from .reset_record                  import ResetRecord

# Where the CPU caches, and no other region of LiteX is.
FAST_RAM_ORIGIN = 0x2000_0000

# Stereo SoC ---------------------------------------------------------------------------------------

class StereoSoC(StereoMixin, CamerasMixin, FrameLinkMixin, CSRRegistersMixin, SoCCore):
    """The SoC of every target: VexRiscv, main memory, matcher and link.

    A target overrides `add_clocking`, `add_main_memory` and `add_link`.

    Parameters
    ----------
    platform
        LiteX platform of the board or of the simulation.
    sys_clk_freq : int
        System clock in Hz.
    parameters, burst_bytes, matcher_clock_domain
        Parameters of the matcher: see `StereoMixin.add_stereo`.
    name : str
        Name that the device reports, at most 15 ASCII characters.
    fast_ram_bytes : int
        Size of an on-chip RAM for the CPU alone, a multiple of 4: what the firmware runs often does not wait for
        frames on their way through main memory. 0 for none; `firmware/linker.ld` says what is in it.
    with_line_reader : bool
        Read the CPU's instructions from DRAM in whole lines, without the bus: see `LineReader`.
    **kwargs
        Passed on to `SoCCore`.
    """
    def __init__(self, platform, sys_clk_freq, parameters, burst_bytes=128,
        matcher_clock_domain="sys", name="litestereo", fast_ram_bytes=0, with_line_reader=False, **kwargs):
        soc_kwargs = dict(
            ident        = f"LiteStereo on {name}",
            cpu_type     = "vexriscv",
            cpu_variant  = "standard",
            timer_uptime = True,
            # The firmware polls: deep enough for what arrives between two polls.
            uart_fifo_depth = 256,
            # Resets the SoC if the firmware hangs; until then its interrupt can record the reason.
            with_watchdog        = True,
            watchdog_reset_delay = sys_clk_freq//20,
        )
        soc_kwargs.update(kwargs)
        self.add_clocking(platform, sys_clk_freq)
        SoCCore.__init__(self, platform, clk_freq=sys_clk_freq, **soc_kwargs)
        self.add_constant("LITESTEREO_NAME", name)
        self.add_constant("UART_RX_FIFO_DEPTH", soc_kwargs["uart_fifo_depth"])
        self.add_constant("UART_TX_FIFO_DEPTH", soc_kwargs["uart_fifo_depth"])
        self.reset_record = ResetRecord()
        self.burst_bytes  = burst_bytes
        self.memory       = memory = self.add_main_memory()
        self.add_stereo(parameters,
            memory       = memory,
            burst_bytes  = burst_bytes,
            clock_domain = matcher_clock_domain,
        )
        self.add_link()
        if fast_ram_bytes:
            self.add_ram("fast_ram", origin=FAST_RAM_ORIGIN, size=fast_ram_bytes)
        if with_line_reader:
            self.add_line_reader()

    def add_line_reader(self):
        """Read the CPU's instructions from DRAM in whole lines."""
        instructions = "cpu_bus0" # LiteX's name for the first bus of the CPU, that of the instructions.
        region       = self.bus.regions["main_ram"]
        self.line_reader = LineReader(self.bus.masters[instructions], self.sdram.crossbar.get_port(mode="read"),
            region.origin, region.size)
        self.bus.masters[instructions] = self.line_reader.bus

    # Hooks ----------------------------------------------------------------------------------------

    def add_clocking(self, platform, sys_clk_freq):
        """Create the clock domain `sys`, and the matcher's if that is another one."""
        raise NotImplementedError

    def add_main_memory(self):
        """Add the region `main_ram`; return the argument `memory` of `add_stereo`."""
        raise NotImplementedError

    def add_link(self):
        """Add links other than the UART; their DMA gets its ports from `self.memory`."""
