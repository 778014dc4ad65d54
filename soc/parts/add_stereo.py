#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.soc.interconnect import wishbone

from ...gateware.peripherals.stereo_crossing   import StereoPeripheralCrossing
from ...gateware.peripherals.stereo_peripheral import StereoPeripheral
from ...gateware.rectification.layouts         import CAMERAS
from .dma_checks                               import DMAChecks

# Bus Ports ----------------------------------------------------------------------------------------

class BusPorts:
    """Memory ports that are masters of the SoC's bus (or of the CPU's coherent DMA bus, if it has one).

    They work everywhere, but share the bus with the CPU: expect several clocks per pixel.
    """
    def __init__(self, soc, name):
        self.soc   = soc
        self.name  = name
        self.modes = [] # Of the ports so far.

    def get_port(self, mode="both"):
        bus  = getattr(self.soc, "dma_bus", self.soc.bus)
        port = wishbone.Interface(
            data_width = bus.data_width,
            adr_width  = bus.get_address_width(standard="wishbone"),
            addressing = "word",
            mode       = {"read": "r", "write": "w", "both": "rw"}[mode],
        )
        self.modes.append(mode)
        number = self.modes.count(mode)
        bus.add_master(name=f"{self.name}_{mode}" + (f"_{number}" if number > 1 else ""), master=port)
        return port

# Stereo Mixin -------------------------------------------------------------------------------------

class StereoMixin(DMAChecks):
    """Gives a LiteX SoC the method `add_stereo`: `class MySoC(StereoMixin, SoCCore)`."""

    def add_stereo(self, parameters, name="stereo", memory=None, burst_bytes=128, clock_domain="sys"):
        """Add a stereo matcher with its DMA, registers and interrupt.

        Parameters
        ----------
        parameters : MatcherParameters
            What is built: widest frame, largest number of disparities, largest block size, optional stages, and the
            rectification, which has a port more for each image that comes out.
        name : str
            Prefix of the peripheral's registers, and name of its interrupt; a C identifier.
        memory : object with `get_port(mode=...)`, optional
            Source of the DMA's ports: `self.sdram.crossbar` of a SDRAM without L2 cache (the crossbar bypasses
            it), a `WideRAM`, or by default the SoC's bus.
        burst_bytes : int
            Bytes of a burst.
        clock_domain : str
            Clock domain of matcher and DMA, if `sys` is too slow for them: see `StereoPeripheralCrossing`.

        Raises
        ------
        ValueError
            If a parameter is not as above. For a cache that is added later, when the SoC is finalized.
        """
        self.check_dma_name(name)
        self.check_if_exists(name)
        if memory is None:
            memory = BusPorts(self, name)
        read_port  = memory.get_port(mode="read")
        write_port = memory.get_port(mode="write")
        images     = ()
        if "rectification" in parameters.features:
            images = tuple(memory.get_port(mode="write") for _ in CAMERAS)
        self.check_dma_ports(name, read_port, write_port, *images)
        crossed = clock_domain != "sys"
        stereo  = (StereoPeripheralCrossing if crossed else StereoPeripheral)(
            read_port   = read_port,
            write_port  = write_port,
            parameters  = parameters,
            burst_bytes = burst_bytes,
            image_ports = images,
            **({"clock_domain": clock_domain} if crossed else {}),
        )
        self.add_module(name=name, module=stereo)
        if self.irq.enabled:
            self.irq.add(name, use_loc_if_exists=True)
