#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the sections measure, as content keys: the Verilog that builds emit, and the code of files.

A change of the sources that does not change the emitted Verilog, or that is in another part of the project, makes no
measurement stale.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from importlib.metadata import version

from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import ClockDomain

from ...firmware import FIRMWARE_DIR
from ...gateware.common.parameters import MatcherParameters
from ...gateware.peripherals.stereo_peripheral import StereoPeripheral
from ...soc.build.pages import computed_key
from ...soc.build.paths import LITEX_PACKAGES, PACKAGE_DIR, content_key
from ...soc.flow.sources import without_dates
from ...soc.flow.synthesis import emit
from ...soc.parts.wide_ram import WideRAM
from ..socs.matcher import MATCHER

#: What a run of a matcher in Verilator depends on, apart from its Verilog.
BENCH = tuple(PACKAGE_DIR / "sim" / "cores" / name for name in ("cosim.py", "stream_core.py", "stream_bench.cpp",
                                                                "core.h"))

#: What the errors of a map depend on.
METRICS = (PACKAGE_DIR / "host_tools" / "evaluation" / "metrics.py",)

#: The reference model.
MODEL = tuple(PACKAGE_DIR / "sim" / "models" / name for name in ("stereo_bm.py", "stages.py"))

#: The model of block matching alone.
BLOCK_MATCHING = (PACKAGE_DIR / "sim" / "models" / "block_matching.py",)

#: The firmware's matcher for the CPU, and its console command; the memory that it is in.
CPU_MATCHER = (FIRMWARE_DIR / "reference", FIRMWARE_DIR / "lib" / "stereo_settings.c", FIRMWARE_DIR / "app" / "bench.c",
               PACKAGE_DIR / "soc" / "parts" / "wide_ram.py")

#: What Verilog is emitted from.
_GATEWARE = [PACKAGE_DIR / name for name in ("gateware", "soc/flow", "soc/parts/wide_ram.py", "sim/socs/matcher.py")]

#: Bytes of the memory of the emitted system; the real one only has a wider address.
_RAM_BYTES = 64*1024


class _System(LiteXModule):
    """The matcher of the simulated SoC with its DMA, on the memory of the simulated SoC with integrated RAM."""
    def __init__(self) -> None:
        self.cd_sys = ClockDomain("sys")
        self.ram    = WideRAM(_RAM_BYTES)
        self.stereo = StereoPeripheral(self.ram.get_port("read"), self.ram.get_port("write"), MATCHER, with_csr=False)


def _computed_key(name: str, text: Callable[[], str]) -> str:
    return computed_key(f"{name}-{versions_key()}", _GATEWARE, lambda: [text()])


def versions_key() -> str:
    """Return the key of the releases that Verilog is emitted by, and that the CPU is from."""
    return content_key(version(name) for name in LITEX_PACKAGES)


@functools.cache
def matcher_key(parameters: MatcherParameters) -> str:
    """Return the key of a matcher's Verilog; it is emitted once for each state of the gateware."""
    built = (parameters.max_width, parameters.max_height, parameters.disparities, parameters.max_block_size,
             *sorted(parameters.features))
    return _computed_key(f"matcher-{content_key(map(str, built))}", lambda: emit(parameters))


def matchers_key(builds: Iterable[MatcherParameters]) -> str:
    """Return the key of the Verilog of several matchers, in this order."""
    return content_key(matcher_key(build) for build in builds)


@functools.cache
def system_key() -> str:
    """Return the key of the Verilog between memory and memory in the simulated SoC with integrated RAM."""
    def text() -> str:
        system = _System()
        ios    = {system.cd_sys.clk, system.cd_sys.rst}
        return without_dates(str(verilog.convert(system, ios=ios, name="system")))
    return _computed_key("system", text)
