#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A memory port for a core on another clock: words in flight, that all of them complete, resets without a clock."""

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
from support.two_clocks import Side, TwoClocks

BURST_BYTES = 16 # Four words of a 32-bit port.
MOST        = 8

PORTS = {
    "wishbone": lambda mode="write": wishbone.Interface(data_width=32, address_width=32, addressing="word"),
    "native":   lambda mode="write": LiteDRAMNativePort(mode=mode, address_width=24, data_width=32),
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


class ReadAndWrite(LiteXModule):
    """A crossing each way, with clock and reset of the core as inputs."""
    def __init__(self, read_port, write_port):
        self.clk, self.rst = Signal(), Signal()
        self.cd_core = ClockDomain()
        self.read    = PortCrossing(read_port,  "read",  "core", BURST_BYTES)
        self.write   = PortCrossing(write_port, "write", "core", BURST_BYTES)
        self.comb   += [self.cd_core.clk.eq(self.clk), self.cd_core.rst.eq(self.rst)]


@pytest.mark.parametrize("still", ["core", "memory"])
@pytest.mark.parametrize("kind", PORTS)
def test_after_a_reset_without_a_clock(kind, still):
    """After a reset while a clock was stopped, each word is read and written once, and nothing is left of before."""
    rng   = byte_generator(27, kind, still)
    ports = {name: PORTS[kind](name) for name in ("read", "write")}
    top   = ReadAndWrite(*ports.values())
    read, write = top.read, top.write
    inputs  = {"clk": top.clk, "rst": top.rst, "read_valid": read.sink.valid, "read_address": read.sink.address,
               "read_take": read.source.ready, "write_valid": write.sink.valid, "write_address": write.sink.address,
               "write_word": write.sink.data}
    outputs = {"read_ready": read.sink.ready, "read_shown": read.source.valid, "read_word": read.source.data,
               "write_ready": write.sink.ready, "written": write.written}
    for name, port in ports.items():
        more_inputs, more_outputs = port_pins(f"{name}_port", port)
        inputs  |= more_inputs
        outputs |= more_outputs
    core   = PinCore(top, inputs, outputs)
    memory = Memory(1 << 10, 4, rng)
    slaves = [slave(core, f"{name}_port", port, memory) for name, port in ports.items()]
    asked, got, taken, written = 0, [], 0, 0
    speed = 1.0 # Share of the core's clocks in which it takes a word.

    def memory_edge():
        if memory_side.resets:
            for one in slaves:
                one.reset()
        for one in slaves:
            one.step()
        core.clock()

    def core_edge():
        nonlocal asked, taken, written
        works = not core_side.resets
        # As the DMA engines of a core do, no more than a burst is under way.
        asks  = works and asked < limit and asked - len(got) < MOST
        puts  = works and taken < limit
        takes = works and rng.random() < speed
        core.set(read_valid=int(asks), read_address=asked, read_take=int(takes), write_valid=int(puts),
                 write_address=128 + taken, write_word=1000*number + taken)
        asked   += asks and core.get("read_ready")
        taken   += puts and core.get("write_ready")
        written += works and core.get("written")
        if takes and core.get("read_shown"):
            got.append(core.get("read_word"))
        core.set(clk=1)
        core.set(clk=0)

    core_side   = Side(core_edge, lambda value: core.set(rst=value))
    memory_side = Side(memory_edge, lambda value: core.hold_reset(value))
    clocks      = TwoClocks(core_side, memory_side, rng)
    number = limit = 0
    clocks.reset_without(core_side)
    for number in range(1, 60):
        clocks.draw()
        memory.speed = rng.choice([1.0, 0.3])
        speed        = rng.choice([1.0, 0.5])
        asked, taken, limit = 0, 0, 100
        got.clear()
        clocks.run(rng.uniform(0.0, 120.0))
        limit = 0
        clocks.reset_without(core_side if still == "core" else memory_side)
        memory.speed = 1.0
        asked = taken = written = 0
        got.clear()
        memory.writes.clear()
        limit = 40
        clocks.run(1200.0)
        assert (asked, taken, written) == (40, 40, 40), number
        assert got == [int.from_bytes(memory.bytes[4*word:4*word + 4], "little") for word in range(40)], number
        assert memory.writes == [4*(128 + word) for word in range(40)], number
        assert memory.bytes[512:512 + 160] == b"".join((1000*number + word).to_bytes(4, "little")
                                                       for word in range(40)), number
    core.close()
