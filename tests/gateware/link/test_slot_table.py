#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The slot table against a set of chunks: the largest frame, chunks marked while slots are cleared or closed."""

from __future__ import annotations

import pytest

from litestereo.gateware.link.message import CHUNK_BYTES
from litestereo.gateware.link.slot_table import SlotTable
from litestereo.sim.cores.pin_core import PinCore
from support.pairs import byte_generator

SLOTS, MAX_CHUNKS = 4, 256
WORDS             = MAX_CHUNKS//32
MOST              = MAX_CHUNKS//2  # Chunks of an image of the largest frame.


class Table:
    """The table as firmware and MessageSorter see it, beside what it should hold."""
    def __init__(self, pipelined: bool, rng) -> None:
        dut = SlotTable(SLOTS, MAX_CHUNKS, pipelined)
        inputs  = {name: getattr(dut, name) for name in ("slot", "frame_id", "base", "pixels", "open", "close", "set",
                                                         "arrived_index")}
        inputs |= {name: getattr(dut.chunk, name) for name in ("offset", "length", "judge")}
        inputs |= {"chunk_id": dut.chunk.frame_id}
        outputs = {name: getattr(dut, name) for name in ("clearing", "found", "address", "arrived", "missing")}
        outputs |= {name: getattr(dut.chunk, name) for name in ("judged", "fits", "repeated")}
        self.core   = PinCore(dut, inputs, outputs)
        self.wait   = 3 if pipelined else 2  # Clocks from the index to its word.
        self.rng    = rng
        self.pixels = {}                     # Of the frame of each slot.
        self.marked = {slot: set() for slot in range(SLOTS)}

    def clock(self, count: int = 1, **pulses: int) -> None:
        self.core.set(**pulses)
        self.core.clock()
        self.core.set(**dict.fromkeys(pulses, 0))
        for _ in range(count - 1):
            self.core.clock()

    def open(self, slot: int, pixels: int, wait: bool = True) -> None:
        self.core.set(slot=slot, frame_id=100 + slot, base=slot << 24, pixels=pixels)
        self.clock(open=1)
        self.pixels[slot] = pixels
        self.marked[slot] = set()
        while wait and self.core.get("clearing"):
            self.clock()

    def close(self, slot: int) -> None:
        self.core.set(slot=slot)
        self.clock(close=1)

    def length(self, slot: int, number: int) -> int:
        """Return the bytes of a chunk; 0 or less if the frame has no such chunk."""
        per_image = -(-self.pixels[slot]//CHUNK_BYTES)
        return min(CHUNK_BYTES, self.pixels[slot] - number % per_image*CHUNK_BYTES) if number < 2*per_image else 0

    def judge(self, slot: int, number: int, length: int | None = None) -> tuple[int, int]:
        """Return whether a chunk fits, and whether it is repeated; it is addressed where it belongs."""
        length = self.length(slot, number) if length is None else length
        self.core.set(chunk_id=100 + slot, offset=number*CHUNK_BYTES, length=length)
        self.core.set(judge=1)
        for _ in range(100):
            if self.core.get("judged"):
                break
            self.clock()
        assert self.core.get("judged")
        verdict = self.core.get("fits"), self.core.get("repeated")
        if verdict[0]:
            assert (self.core.get("found"), self.core.get("address")) == (slot, (slot << 24) + number*CHUNK_BYTES)
        self.clock(judge=0)
        return verdict

    def mark(self, slot: int, number: int) -> None:
        """Mark the chunk that was judged last."""
        self.clock(set=1)
        self.marked[slot].add(number)

    def check(self) -> None:
        """Compare the bitmaps of all slots with what was marked."""
        for slot in self.pixels:
            for word in range(WORDS):
                self.core.set(arrived_index=slot*WORDS + word)
                self.clock(self.wait)
                expected = sum(1 << bit for bit in range(32) if 32*word + bit in self.marked[slot])
                assert self.core.get("arrived") == expected, (slot, word)

    def missing(self, slot: int) -> int:
        self.core.set(arrived_index=slot*WORDS)
        self.clock(2)
        return self.core.get("missing")


@pytest.fixture(params=[False, True], ids=["plain", "pipelined"])
def table(request):
    table = Table(request.param, byte_generator(60, str(request.param)))
    yield table
    table.core.close()


@pytest.mark.parametrize("pixels", [(MOST - 1)*CHUNK_BYTES, (MOST - 1)*CHUNK_BYTES + 1, MOST*CHUNK_BYTES - 1,
                                    MOST*CHUNK_BYTES])
def test_the_largest_frames(table, pixels):
    """Every chunk of a frame of at most max_chunks fits once, and the one after its last does not."""
    table.open(2, pixels)
    table.open(3, CHUNK_BYTES)
    count = 2*-(-pixels//CHUNK_BYTES)
    order = table.rng.sample(range(count), count)
    assert table.missing(2) == count
    for number in order:
        for wrong in {1, table.length(2, number) - 1, table.length(2, number) + 1, CHUNK_BYTES} - {
                table.length(2, number)}:
            assert table.judge(2, number, wrong)[0] == 0
        assert table.judge(2, number) == (1, 0)
        table.mark(2, number)
        assert table.judge(2, number) == (1, 1)
    assert table.missing(2) == 0
    for number in (count, count + 1, 2*count):
        assert table.judge(2, number, CHUNK_BYTES)[0] == 0
    table.check()


def test_missing_is_of_the_slot_of_the_clock_before(table):
    """What a slot lacks is shown a clock after the index that names the slot."""
    table.open(1, CHUNK_BYTES)
    table.open(2, 3*CHUNK_BYTES)
    assert table.missing(1) == 2
    table.core.set(arrived_index=2*WORDS)
    assert table.core.get("missing") == 2
    table.clock()
    assert table.core.get("missing") == 6


def test_a_frame_that_is_too_large(table):
    """A pixel more than the largest frame, and no chunk fits."""
    table.open(1, MOST*CHUNK_BYTES + 1)
    for number in (0, 1, MOST - 1, MOST, MAX_CHUNKS - 1, MAX_CHUNKS):
        assert table.judge(1, number, CHUNK_BYTES)[0] == 0
        assert table.judge(1, number, 1)[0] == 0


def test_chunks_of_one_word_after_one_another(table):
    """A chunk that is judged in the clock after another one of its word was marked keeps both marks."""
    table.open(0, 40*CHUNK_BYTES)
    for number in table.rng.sample(range(80), 80):
        assert table.judge(0, number) == (1, 0)
        table.mark(0, number)
    table.check()
    assert all(table.judge(0, number) == (1, 1) for number in range(80))


def test_chunks_marked_while_another_slot_is_cleared(table):
    """In any clock of the clearing the mark is kept, and the slot is cleared."""
    for slot in range(SLOTS):
        table.open(slot, 60*CHUNK_BYTES)
    for phase in range(WORDS + 3):
        for slot in range(SLOTS):
            for number in table.rng.sample(sorted(set(range(120)) - table.marked[slot]), 4):
                assert table.judge(slot, number) == (1, 0)
                table.mark(slot, number)
        cleared, slot = table.rng.sample(range(SLOTS), 2)
        number = table.rng.choice(sorted(set(range(120)) - table.marked[slot]))
        table.close(cleared)
        assert table.judge(slot, number) == (1, 0)
        table.open(cleared, 60*CHUNK_BYTES, wait=False)
        assert table.core.get("clearing")
        if phase:
            table.clock(phase)
        table.mark(slot, number)
        # Judged at once: the verdict waits for the end of the clearing.
        assert table.judge(slot, number) == (1, 1)
        assert not table.core.get("clearing")
        table.check()


def test_a_slot_closed_before_its_chunk_is_marked(table):
    """The mark of a chunk whose slot is closed meanwhile falls into no other slot."""
    for slot in range(SLOTS):
        table.open(slot, 60*CHUNK_BYTES)
    for _ in range(20):
        slot   = table.rng.randrange(1, SLOTS)
        number = table.rng.randrange(120)
        other  = table.rng.choice(sorted(set(range(120)) - table.marked[0]))
        assert table.judge(0, other) == (1, 0)
        table.mark(0, other)
        assert table.judge(slot, number) == (1, 0)
        table.close(slot)
        table.clock(table.rng.randrange(1, 8))
        table.mark(slot, number)
        table.check()
        table.open(slot, 60*CHUNK_BYTES)
        if len(table.marked[0]) > 100:
            table.close(0)
            table.open(0, 60*CHUNK_BYTES)
