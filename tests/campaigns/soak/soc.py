#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The simulated SoC without its CPU: the register bus, the memory ports and the wire are pins of the top level.
`machine.cpp` connects them."""

from __future__ import annotations

import logging

from litex.build.sim import SimPlatform
from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from litex.soc.integration.export import get_csr_header, get_soc_header
from litex.soc.interconnect import wishbone
from migen import ResetSignal, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.sim.socs.ethernet_model import EthernetPHYModel
from litestereo.sim.socs.simulated_soc import SimulatedCRG
from litestereo.soc.flow.mapping import with_garbage
from litestereo.soc.parts.stereo_soc import StereoSoC

CLOCK_HZ = 200_000 # A second has few clocks, so that the firmware's timeouts come soon.
RAM_BITS = 64
MATCHER  = MatcherParameters(max_width=64, disparities=16, max_block_size=9)


class Wire:
    """Pads of the Ethernet model."""
    def __init__(self, pin) -> None:
        for side in ("source", "sink"):
            for name, bits in (("valid", 1), ("ready", 1), ("data", 8)):
                setattr(self, f"{side}_{name}", pin(f"{side}_{name}", bits))


class Ports(LiteXModule):
    """Main memory outside the SoC: Wishbone pins for each requested port, without an arbiter."""
    def __init__(self, pin) -> None:
        self.pin   = pin
        self.count = 0

    def get_port(self, mode: str = "both") -> wishbone.Interface:
        port = wishbone.Interface(data_width=RAM_BITS, address_width=32, addressing="word",
                                  mode={"read": "r", "write": "w", "both": "rw"}[mode])
        for name in ("adr", "dat_w", "cyc", "stb", "we", "sel"):
            self.comb += self.pin(f"ram{self.count}_{name}", len(getattr(port, name))).eq(getattr(port, name))
        for name in ("dat_r", "ack", "err"):
            self.comb += getattr(port, name).eq(self.pin(f"ram{self.count}_{name}", len(getattr(port, name))))
        self.count += 1
        return port


class SoakSoC(StereoSoC):
    """Matcher, frame link, LiteEth's UDP core, timer, watchdog and reset record; pins of a bus master replace the CPU.

    With `own_clock` the matcher's clock is a pin too, and there are no streamed frames.
    """
    def __init__(self, own_clock: bool) -> None:
        self.pins: set[Signal] = set()
        self.own_clock = own_clock
        StereoSoC.__init__(self, SimPlatform("SIM", []), CLOCK_HZ, name="soak", cpu_type=None, cpu_variant=None,
                           ident="", with_uart=False, integrated_rom_size=0, integrated_sram_size=0,
                           matcher_clock_domain="matcher" if own_clock else "sys", parameters=MATCHER, burst_bytes=64)
        host = wishbone.Interface(data_width=32, address_width=32, addressing="word")
        self.bus.add_master(name="host", master=host)
        for name in ("adr", "dat_w", "cyc", "stb", "we", "sel"):
            self.comb += getattr(host, name).eq(self.pin(f"host_{name}", len(getattr(host, name))))
        for name in ("dat_r", "ack", "err"):
            self.comb += self.pin(f"host_{name}", len(getattr(host, name))).eq(getattr(host, name))
        self.comb += [
            self.pin("in_reset", 1).eq(ResetSignal("sys")),
            self.pin("stereo_irq", 1).eq(self.stereo.ev.irq),
            self.pin("watchdog_irq", 1).eq(self.watchdog0.ev.irq),
        ]

    def pin(self, name: str, bits: int) -> Signal:
        """Return a new pin of the top level; its use decides whether it is an input."""
        signal = Signal(bits, name_override=name)
        self.pins.add(signal)
        return signal

    def add_clocking(self, platform, sys_clk_freq) -> None:
        self.crg = SimulatedCRG(self.pin("sys_clk", 1))
        if self.own_clock:
            self.crg.add_matcher(self.pin("matcher_clk", 1))

    def add_main_memory(self) -> Ports:
        self.ports = Ports(self.pin)
        return self.ports

    def add_link(self) -> None:
        self.ethphy = EthernetPHYModel(self.pin("eth_clk", 1), Wire(self.pin))
        self.add_frame_link(self.ethphy, memory=self.memory, burst_bytes=self.burst_bytes)


def emitted(own_clock: bool) -> dict[str, str]:
    """Return the Verilog of the SoC, and LiteX's headers for its firmware: name and text of each file."""
    # LiteX logs all its steps.
    logging.disable(logging.WARNING)
    soc = SoakSoC(own_clock)
    soc.finalize()
    return {
        "core.v": with_garbage(verilog.convert(soc.get_fragment(), ios=soc.pins, name="core").main_source),
        "csr.h":  get_csr_header(soc.csr_regions, soc.constants, csr_base=soc.mem_regions["csr"].origin),
        "soc.h":  get_soc_header(soc.constants),
    }
