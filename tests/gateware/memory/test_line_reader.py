#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Lines of a cache come from the memory's port, all other transfers pass, and a line may be given up."""

from __future__ import annotations

import pytest
from litedram.common import LiteDRAMNativePort
from litex.soc.interconnect import wishbone

from litestereo.gateware.memory.line_reader import LineReader
from litestereo.sim.cores.pin_core import PinCore
from support.memory import Memory, port_pins, slave
from support.pairs import byte_generator

ORIGIN, SIZE = 0x4000_0000, 1 << 16


class Bench:
    """The core with a memory at its port, another one on its bus, and a cache's side that is driven word by word."""
    def __init__(self, width: int, speed: float) -> None:
        port   = LiteDRAMNativePort(mode="read", address_width=24, data_width=width)
        master = wishbone.Interface(data_width=32, address_width=32, addressing="word")
        top    = LineReader(master, port, ORIGIN, SIZE)
        inputs, outputs = {}, {}
        for name, signals in [("port", port), ("bus", top.bus)]:
            more_inputs, more_outputs = port_pins(name, signals)
            inputs  |= more_inputs
            outputs |= more_outputs
        inputs  |= {name: getattr(master, name) for name in ("adr", "cyc", "stb", "we", "cti", "sel", "dat_w")}
        outputs |= {name: getattr(master, name) for name in ("ack", "dat_r")}
        # The port's data, and its writes, are not used.
        outputs = {name: signal for name, signal in outputs.items() if not name.startswith("port_wdata")}
        inputs.pop("port_wdata_ready")
        self.core   = PinCore(top, inputs, outputs)
        self.rng    = byte_generator(27, f"{width} {speed}")
        self.memory = Memory(SIZE, width//8, self.rng, speed)
        self.others = Memory(1 << 10, 4, self.rng, speed)
        self.slaves = [slave(self.core, "port", port, self.memory), slave(self.core, "bus", top.bus, self.others)]
        self.slaves[0].put = self._put_port
        self.core.reset()

    def _put_port(self, **values: int) -> None:
        values.pop("wdata_ready", None)
        self.core.set(**{f"port_{name}": value for name, value in values.items()})

    def clock(self) -> int | None:
        """Run a clock; return the word of the answer, if there was one."""
        for side in self.slaves:
            side.step()
        word = self.core.get("dat_r") if self.core.get("ack") else None
        self.core.clock()
        return word

    def transfer(self, address: int, cti: int, we: int = 0, data: int = 0) -> int:
        """Return the answer to a transfer."""
        self.core.set(adr=address//4, cyc=1, stb=1, we=we, cti=cti, sel=15, dat_w=data)
        for _ in range(1000):
            word = self.clock()
            if word is not None:
                self.core.set(cyc=0, stb=0)
                return word
        raise AssertionError("no answer")

    def line(self, offset: int) -> bytes:
        """Return a line of the memory, as a cache fetches it: its bus does not rest between two transfers."""
        words = [self.transfer(ORIGIN + offset + 4*n, 7 if n == 7 else 2) for n in range(8)]
        return b"".join(word.to_bytes(4, "little") for word in words)


@pytest.fixture(params=[(32, 1.0), (32, 0.3), (64, 0.3), (128, 0.3)], ids=str)
def bench(request: pytest.FixtureRequest) -> Bench:
    """Return a bench for a width of the port and a speed of its memory."""
    return Bench(*request.param)


def test_lines_and_others(bench):
    """Lines come from the port, each word read once; what is no line of the memory goes to the bus."""
    for _ in range(60):
        offset = 32*bench.rng.randrange(SIZE//32)
        bench.memory.reads.clear()
        bench.others.reads.clear()
        assert bench.line(offset) == bytes(bench.memory.bytes[offset:offset + 32])
        step = bench.memory.word_bytes
        assert bench.memory.reads == list(range(offset, offset + 32, step))
        assert not bench.others.reads
        # A single word of the memory, a line elsewhere, and a write.
        for address, cti in [(ORIGIN + offset, 0), (offset, 2), (ORIGIN + SIZE + offset, 2), (ORIGIN + offset + 4, 2)]:
            assert bench.transfer(address, cti) == bench.others.read(address//4)
        value = bench.rng.getrandbits(32)
        bench.transfer(ORIGIN + offset, 2, 1, value)
        assert bench.others.read((ORIGIN + offset)//4) == value
        assert len(bench.memory.reads) == 32//step


def test_one_wait_per_line():
    """A memory that never waits gives a line in twelve clocks at most."""
    bench  = Bench(32, 1.0)
    clocks = 0
    clock  = bench.clock

    def counted() -> int | None:
        nonlocal clocks
        clocks += 1
        return clock()

    bench.clock = counted
    for offset in (0, 64, 32):
        bench.line(offset)
    assert clocks <= 3*12


def test_given_up_lines(bench):
    """After a line that was given up at any word, the next one is whole."""
    for _ in range(60):
        words = bench.rng.randrange(8)
        first = 32*bench.rng.randrange(SIZE//32)
        for n in range(words):
            bench.transfer(ORIGIN + first + 4*n, 2)
        if words == 0:
            bench.core.set(adr=(ORIGIN + first)//4, cyc=1, stb=1, we=0, cti=2)
            bench.clock()
        bench.core.set(cyc=0, stb=0)
        for _ in range(bench.rng.randrange(1, 4)):
            bench.clock()
        offset = 32*bench.rng.randrange(SIZE//32)
        assert bench.line(offset) == bytes(bench.memory.bytes[offset:offset + 32])
