#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What `add_stereo` and `add_frame_link` refuse: ports that bypass the SoC's cache, and names that C does not have."""

from __future__ import annotations

import string

import pytest
from litedram.modules import M12L64322A
from litedram.phy.model import SDRAMPHYModel
from litex.build.generic_platform import Pins
from litex.build.sim import SimPlatform
from litex.gen import LiteXModule
from litex.soc.integration.soc import SoCRegion
from litex.soc.integration.soc_core import SoCCore
from litex.soc.interconnect import wishbone
from migen import ClockDomain, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.sim.socs.ethernet_model import EthernetPHYModel
from litestereo.soc.parts.add_frame_link import FrameLinkMixin
from litestereo.soc.parts.add_stereo import StereoMixin
from litestereo.soc.parts.wide_ram import WideRAM
from support.pairs import byte_generator

CLOCK_HZ   = int(60e6)
PARAMETERS = MatcherParameters(max_width=48, disparities=16, max_block_size=5)
IO         = [("sys_clk", 0, Pins(1)), ("eth_clk", 0, Pins(1))]


class Pads(LiteXModule):
    """The wire of the Ethernet model."""
    def __init__(self):
        for side in ("source", "sink"):
            for name, bits in [("valid", 1), ("ready", 1), ("data", 8)]:
                setattr(self, f"{side}_{name}", Signal(bits))


class PlainSoC(StereoMixin, FrameLinkMixin, SoCCore):
    """A SoC without a CPU: clock, and a port of the Ethernet model."""
    def __init__(self):
        platform = SimPlatform("SIM", IO)
        self.cd_sys = ClockDomain()
        SoCCore.__init__(self, platform, clk_freq=CLOCK_HZ, cpu_type=None, with_uart=False, with_timer=False, ident="",
                         integrated_sram_size=0)
        self.comb += self.cd_sys.clk.eq(platform.request("sys_clk"))
        self.pads   = Pads()
        self.ethphy = EthernetPHYModel(platform.request("eth_clk"), self.pads)
        self.bus.add_master("test", wishbone.Interface(data_width=32, addressing="word"))

    def add_ram(self, l2_bytes):
        """Add an SDRAM as main memory, with a cache of that size in front of it."""
        module      = M12L64322A(CLOCK_HZ, "1:1")
        self.sdrphy = SDRAMPHYModel(module, data_width=32, clk_freq=CLOCK_HZ)
        self.add_sdram("sdram", phy=self.sdrphy, module=module, l2_cache_size=l2_bytes)

    def add_wide_ram(self, l2_bytes):
        """Add a memory on chip, with a cache of that size in front of it, which is not the SDRAM's."""
        self.wide_ram = WideRAM(4096, data_width=32)
        bus           = self.wide_ram.bus
        if l2_bytes:
            bus = wishbone.Interface(data_width=32, address_width=32, addressing="word")
            self.wide_cache = wishbone.Cache(l2_bytes//4, bus, self.wide_ram.bus)
        self.bus.add_slave("wide_ram", bus, SoCRegion(origin=0x9000_0000, size=4096, mode="rw"))

    def add(self, kind, memory=None, name=None):
        """Add the matcher or the frame link."""
        kwargs = {} if name is None else {"name": name}
        if kind == "stereo":
            self.add_stereo(PARAMETERS, memory=memory, **kwargs)
        else:
            self.add_frame_link(self.ethphy, memory=memory, max_chunks=32, **kwargs)


@pytest.mark.parametrize("kind", ["stereo", "frame_link"])
@pytest.mark.parametrize("l2_bytes", [64, 8192])
def test_ports_that_bypass_a_cache_are_refused(kind, l2_bytes):
    soc = PlainSoC()
    soc.add_ram(l2_bytes)
    with pytest.raises(ValueError, match=f"^{kind}: .*bypasses the SDRAM's L2 cache.*l2_cache_size=0"):
        soc.add(kind, soc.sdram.crossbar)


@pytest.mark.parametrize("kind", ["stereo", "frame_link"])
def test_ports_that_another_object_hands_on_are_refused(kind):
    class Memory:
        def get_port(self, mode):
            return soc.sdram.crossbar.get_port(mode=mode)

    soc = PlainSoC()
    soc.add_ram(8192)
    with pytest.raises(ValueError, match="L2 cache"):
        soc.add(kind, Memory())


@pytest.mark.parametrize("kind", ["stereo", "frame_link"])
def test_a_cache_that_comes_later_is_refused_at_the_end(kind):
    soc = PlainSoC()
    soc.add_ram(0)
    soc.add(kind, soc.sdram.crossbar)
    other = wishbone.Interface(data_width=32, address_width=32, addressing="word")
    soc.later_cache = wishbone.Cache(1024, other, wishbone.Interface(data_width=128, address_width=32,
                                                                     addressing="word"))
    with pytest.raises(ValueError, match=f"^{kind}: .*L2 cache"):
        soc.finalize()


def drawn_memory(rng, soc, where):
    """Add memories of which none that the DMA uses is behind a cache; return the argument `memory`."""
    soc.add_ram(0 if where == "crossbar" else rng.choice([0, 512, 8192]))
    soc.add_wide_ram(0 if where == "wide" else rng.choice([512, 4096]))
    return {"crossbar": soc.sdram.crossbar, "bus": None, "wide": soc.wide_ram}[where]


@pytest.mark.parametrize("where", ["crossbar", "bus", "wide"])
def test_memories_without_a_bypassed_cache_are_accepted(where):
    rng    = byte_generator(811, len(where))
    soc    = PlainSoC()
    memory = drawn_memory(rng, soc, where)
    for kind in rng.sample(["stereo", "frame_link"], 2):
        soc.add(kind, memory)
    soc.finalize()


FIRST = string.ascii_letters + "_"
LATER = FIRST + string.digits


@pytest.mark.parametrize("kind", ["stereo", "frame_link"])
@pytest.mark.parametrize("number", range(6))
def test_names_are_c_identifiers(kind, number):
    rng  = byte_generator(812, number)
    name = rng.choice(FIRST) + "".join(rng.choices(LATER, k=rng.randrange(12)))
    if rng.randrange(3):
        # One character that C does not allow there, at any place.
        place = rng.randrange(len(name) + 1)
        wrong = rng.choice([*" -.:/\"'\n\0", "é", "٣", "µ", *([] if place else string.digits)])
        bad   = name[:place] + wrong + name[place:]
        soc   = PlainSoC()
        with pytest.raises(ValueError, match="^name must be a C identifier") as refused:
            soc.add(kind, name=bad)
        assert "\n" not in str(refused.value)
    soc = PlainSoC()
    soc.add(kind, name=name)
    assert hasattr(soc, name)


@pytest.mark.parametrize("kind", ["stereo", "frame_link"])
@pytest.mark.parametrize("name", ["", "2nd", 7, b"stereo", "a b", "stéréo", "stereo\n"])
def test_no_name_of_another_kind_is_accepted(kind, name):
    with pytest.raises(ValueError, match="C identifier"):
        PlainSoC().add(kind, name=name)
