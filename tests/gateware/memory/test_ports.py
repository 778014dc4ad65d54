#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Words of a `MemoryWriter` are at LiteDRAM's port when it takes them, however deep the FIFO is."""

from __future__ import annotations

import pytest
from litedram.common import LiteDRAMNativePort

from litestereo.gateware.memory.ports import MemoryWriter
from litestereo.sim.cores.pin_core import PinCore
from support import memory
from support.memory import Memory, NativeSlave, port_pins
from support.pairs import byte_generator

SIZE = 1 << 10

#: Depths on both sides of the one from which on the FIFO is block RAM, and a clock slower.
DEPTHS = [4, 16, 31, 32, 64]


class Bench:
    """A writer with a memory at its port."""
    def __init__(self, depth: int, width: int = 32) -> None:
        port   = LiteDRAMNativePort(mode="write", address_width=24, data_width=width)
        top    = MemoryWriter(port, fifo_depth=depth)
        inputs, outputs = port_pins("port", port)
        # A writer reads nothing.
        unused  = {"port_rdata_valid", "port_rdata_data", "port_rdata_ready"}
        inputs  = {name: signal for name, signal in inputs.items() if name not in unused}
        outputs = {name: signal for name, signal in outputs.items() if name not in unused}
        inputs  |= {f"sink_{name}": getattr(top.sink, name) for name in ("valid", "address", "data")}
        outputs |= {"sink_ready": top.sink.ready, "written": top.written}
        self.core   = PinCore(top, inputs, outputs)
        self.rng    = byte_generator(28, f"{depth} {width}")
        self.memory = Memory(SIZE, width//8, self.rng)
        self.slave  = NativeSlave(self.core, "port", self.memory)
        put = self.slave.put
        self.slave.put = lambda **values: put(**{name: value for name, value in values.items()
                                                 if not name.startswith("rdata")})
        self.core.reset()

    def write(self, count: int, pace: float, speed: float) -> None:
        """Write random words, offered and taken by chance; check that memory has them, and that each was reported."""
        self.memory.speed = speed
        expected = bytearray(self.memory.bytes)
        offered, given, written = None, 0, 0
        for _ in range(60*count):
            if offered is None and given < count and self.rng.random() < pace:
                bits    = 8*self.memory.word_bytes
                offered = self.rng.randrange(8*SIZE//bits), self.rng.getrandbits(bits)
            address, data = offered or (0, 0)
            self.core.set(sink_valid=int(offered is not None), sink_address=address, sink_data=data)
            self.slave.step()
            written += self.core.get("written")
            if offered is not None and self.core.get("sink_ready"):
                start = address*self.memory.word_bytes
                expected[start:start + self.memory.word_bytes] = data.to_bytes(self.memory.word_bytes, "little")
                given  += 1
                offered = None
            self.core.clock()
            if written == count:
                break
        assert (given, written) == (count, count)
        assert self.memory.bytes == expected


@pytest.mark.parametrize("depth", DEPTHS)
def test_words_are_there(depth):
    """A memory that takes words as early as it may, or later, finds each of them."""
    bench = Bench(depth)
    for pace in (1.0, 0.5, 0.05):
        for speed in (1.0, 0.7, 0.2):
            bench.write(150, pace, speed)


def test_a_word_that_is_late_is_found(monkeypatch):
    """The memory of these tests notices a word that comes a clock too late."""
    monkeypatch.setattr(memory, "WRITE_CLOCKS", memory.WRITE_CLOCKS - 1)
    with pytest.raises(AssertionError, match="was not there"):
        Bench(DEPTHS[-1]).write(150, 1.0, 1.0)
