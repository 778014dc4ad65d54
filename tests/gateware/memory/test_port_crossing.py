#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A memory port for a core on another clock: the limit of words in flight, and that all of them complete."""

from __future__ import annotations

import pytest
from litedram.common import LiteDRAMNativePort
from litex.gen import LiteXModule
from litex.soc.interconnect import wishbone
from migen import ClockDomain, Signal

from litestereo.gateware.memory.port_crossing import PortCrossing
from litestereo.sim.cores.pin_core import PinCore
from support.memory import Memory, port_pins, slave
from support.pairs import byte_generator

BURST_BYTES = 16 # Four words of a 32-bit port.
MOST        = 8

PORTS = {
    "wishbone": lambda: wishbone.Interface(data_width=32, address_width=32, addressing="word"),
    "native":   lambda: LiteDRAMNativePort(mode="write", address_width=24, data_width=32),
}


class Top(LiteXModule):
    """The crossing, with clock and reset of the core as inputs."""
    def __init__(self, port):
        self.clk, self.rst = Signal(), Signal()
        self.cd_core  = ClockDomain()
        self.crossing = PortCrossing(port, "write", "core", BURST_BYTES)
        self.comb += [self.cd_core.clk.eq(self.clk), self.cd_core.rst.eq(self.rst)]


@pytest.mark.parametrize("kind", PORTS)
def test_words_under_way(kind):
    """A memory that stalls gets as many words as the core can count; each is written once, in order, and confirmed."""
    port = PORTS[kind]()
    top  = Top(port)
    sink = top.crossing.sink
    more_inputs, more_outputs = port_pins("port", port)
    core = PinCore(top, {"clk": top.clk, "rst": top.rst, "valid": sink.valid, "address": sink.address,
                         "data": sink.data} | more_inputs,
                   {"ready": sink.ready, "written": top.crossing.written} | more_outputs)
    rng    = byte_generator(26, kind)
    memory = Memory(1 << 10, 4, rng, speed=0.0)
    behind = slave(core, "port", port, memory)
    for _ in range(4):
        core.set(rst=1, clk=1)
        core.set(clk=0)
        core.reset()
    core.set(rst=0)
    words = [rng.getrandbits(32) for _ in range(200)]
    taken = written = 0
    for clock in range(2000):
        # At first the memory does not answer at all, then it keeps up.
        memory.speed = 0.0 if clock < 200 else 1.0
        for _ in range(rng.choice((0, 1, 2))):
            core.set(valid=int(taken < len(words)), address=taken, data=words[min(taken, len(words) - 1)])
            goes     = taken < len(words) and core.get("ready")
            written += core.get("written")
            taken   += bool(goes)
            assert taken - written <= MOST
            core.set(clk=1)
            core.set(clk=0)
        behind.step()
        core.clock()
        if clock == 199:
            assert (taken, written) == (MOST, 0)
    assert taken == written == len(words)
    assert memory.writes == [4*place for place in range(len(words))]
    assert bytes(memory.bytes[:4*len(words)]) == b"".join(word.to_bytes(4, "little") for word in words)
    core.close()
