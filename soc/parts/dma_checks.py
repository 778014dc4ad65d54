#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Check what `add_stereo` and `add_frame_link` are given: the peripheral's name, and the memory of its DMA."""

import re

from migen import *

from litex.soc.interconnect import wishbone

from litedram.common import LiteDRAMNativePort

from ...gateware.common.parameters import check

# Helpers ------------------------------------------------------------------------------------------

def has_cached_sdram(soc):
    """Return whether a SoC with an SDRAM has a cache in front of it, as `add_sdram` adds it by default.

    LiteX does not keep which memory a cache is for. Those in front of a serial RAM end at the `bus` of its core, which
    is a module of the SoC; any other counts as the SDRAM's.
    """
    modules = [module for _, module in soc._submodules]
    others  = [module.bus for module in modules if isinstance(getattr(module, "bus", None), wishbone.Interface)]
    return any(isinstance(module, wishbone.Cache) and not any(module.slave is bus for bus in others)
        for module in modules)

# DMA Checks ---------------------------------------------------------------------------------------

class DMAChecks:
    """Base of the mixins: refuses names and memories that LiteX accepts, but with which nothing works."""

    def check_dma_name(self, name):
        """Raise ValueError unless `name` is a C identifier: it is part of names in the generated headers."""
        check(isinstance(name, str) and re.fullmatch("[A-Za-z_][A-Za-z0-9_]*", name),
            f"name must be a C identifier, because the generated headers contain it, not {name!r}.")

    def check_dma_ports(self, name, *ports):
        """Raise ValueError if the ports bypass a cache that the SoC has; check again when the SoC is complete."""
        if any(isinstance(port, LiteDRAMNativePort) for port in ports):
            self._check_sdram(name)
            # A tuple, because LiteX may treat a list as modules.
            self._on_sdram = (*getattr(self, "_on_sdram", ()), name)

    def _check_sdram(self, name):
        check(not has_cached_sdram(self),
            f"{name}: a LiteDRAM port bypasses the SDRAM's L2 cache, so the DMA and the CPU would see different data: "
            "use add_sdram with l2_cache_size=0, or leave out memory.")

    def finalize(self, *args, **kwargs):
        """Complete the SoC; raise ValueError if a cache was added after the ports that bypass it."""
        for name in getattr(self, "_on_sdram", ()):
            self._check_sdram(name)
        super().finalize(*args, **kwargs)
