#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The CRCs of messages against zlib: any number of bytes, in words with anything after the last byte."""

from __future__ import annotations

import random
import zlib
from collections.abc import Iterator

import pytest

from litestereo.gateware.link.message_crc import CheckCRC, SumCRC
from litestereo.sim.cores.pin_core import PinCore
from support.pairs import byte_generator

LENGTHS = [*range(1, 14), 28, 1023, 1024]


class CRC:
    """A core, which gets the words of one message after the other, with pauses."""
    def __init__(self, kind: type, output: str) -> None:
        dut       = kind()
        self.pins = PinCore(dut, {name: getattr(dut, name) for name in ("data", "be", "ce", "reset")},
                            {"result": getattr(dut, output)})

    def run(self, data: bytes, rng: random.Random) -> int:
        """Return the core's output in the clock after the last word."""
        self.clock(reset=1, ce=rng.getrandbits(1), data=rng.getrandbits(32))
        for word, be in words(data, rng):
            while rng.random() < 0.3:
                self.clock(data=rng.getrandbits(32), be=1 << rng.randrange(4))
            self.clock(data=word, be=be, ce=1)
        return self.pins.get("result")

    def clock(self, **pins: int) -> None:
        self.pins.set(**{"ce": 0, "reset": 0} | pins)
        self.pins.clock()


def words(data: bytes, rng: random.Random) -> Iterator[tuple[int, int]]:
    """Yield words and the marks of their last bytes."""
    for place in range(0, len(data), 4):
        some = data[place:place + 4]
        yield int.from_bytes(some + rng.randbytes(4 - len(some)), "little"), 1 << len(some) - 1


@pytest.fixture
def core(request):
    core = CRC(*request.param)
    yield core
    core.pins.close()


@pytest.mark.parametrize("core", [(SumCRC, "value")], indirect=True)
def test_sum(core):
    rng = byte_generator(1)
    for length in LENGTHS*10:
        data = rng.randbytes(length)
        assert core.run(data, rng) == zlib.crc32(data), length


@pytest.mark.parametrize("core", [(CheckCRC, "error")], indirect=True)
def test_check(core):
    """Words that end in their CRC are right, with any bit changed they are wrong, and so is a byte less or more."""
    rng = byte_generator(2)
    for length in LENGTHS*4:
        data  = rng.randbytes(length)
        right = data + zlib.crc32(data).to_bytes(4, "little")
        assert core.run(right, rng) == 0, length
        place = rng.randrange(len(right))
        wrong = right[:place] + bytes([right[place] ^ 1 << rng.randrange(8)]) + right[place + 1:]
        for damaged in (wrong, right[:-1], right + bytes(1), right + rng.randbytes(1)):
            assert core.run(damaged, rng) == 1, length
