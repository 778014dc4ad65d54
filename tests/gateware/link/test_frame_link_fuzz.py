#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Datagrams of a faulty or hostile host to the frame link; every byte of memory is checked."""

from __future__ import annotations

import os
import random

import pytest

from litestereo.host_tools.protocol.messages import CHUNK_BYTES
from support.limits import BLOCK, Draws, Range
from support.link_bench import (
    MAILBOX_BASE,
    MEMORY_BYTES,
    PEER,
    SLOT_BYTES,
    SLOTS,
    Datagram,
    LinkBench,
    chunk_offsets,
    pairs,
    upload,
    with_crc,
)
from support.pairs import byte_generator

#: `make fuzz` sends a hundred thousand.
DATAGRAMS = int(os.environ.get("LITESTEREO_DATAGRAMS", "20000"))
BATCH     = 250

#: The streamed frame.
STREAMED = 77

WORD_BYTES    = 8
MAILBOX_BYTES = 8*2048


class Hostile:
    """Makes almost valid datagrams, and knows the memory that must result."""
    def __init__(self, rng: random.Random, memory: bytes) -> None:
        self.rng    = rng
        self.draws  = Draws(rng, {"pixels": Range(1, 10*CHUNK_BYTES), "streamed": Range(1, 6*CHUNK_BYTES)})
        self.memory = bytearray(memory)
        self.known  = bytearray(b"\1"*len(memory))          # 0: any value is allowed.
        self.known[MAILBOX_BASE:MAILBOX_BASE + MAILBOX_BYTES] = bytes(MAILBOX_BYTES)
        self.open:    dict[int, tuple[int, int]] = {}       # Frame id and pixels by slot,
        self.arrived: dict[int, set[int]]        = {}       # and offsets received.

    def reopen(self, slot: int) -> tuple[int, int]:
        """Open another frame in the slot."""
        self.open[slot]    = (self.rng.randrange(1, 9)*SLOTS + slot, self.draws("pixels"))
        self.arrived[slot] = set()
        return self.open[slot]

    def datagram(self) -> Datagram:
        """Return a datagram, and put what it must write into `memory`."""
        rng             = self.rng
        slot            = rng.randrange(SLOTS)
        frame_id, image = self.open[slot]
        offset, length  = rng.choice(chunk_offsets(image))
        kind            = rng.randrange(9)
        payload         = rng.randbytes(length)
        if kind <= 2:
            if offset not in self.arrived[slot]:
                self.arrived[slot].add(offset)
                self.write(slot*SLOT_BYTES + offset, payload)
            return Datagram(upload(frame_id, offset, payload))
        if kind == 3:
            # A field changed, with a correct CRC.
            data  = bytearray(upload(frame_id, offset, payload)[:-4])
            place = rng.choice([*range(4, 8), *range(12, 24)])
            data[place] ^= 1 << rng.randrange(8)
            changed = int.from_bytes(data[12:16], "little"), int.from_bytes(data[16:20], "little")
            if place >= 12 and self.would_fit(*changed, length) and place < 20:
                return self.datagram()
            return Datagram(with_crc(bytes(data)))
        if kind == 4:
            # A bit changed, with a wrong CRC.
            data = bytearray(upload(frame_id, offset, payload))
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            return Datagram(bytes(data))
        if kind == 5:
            return Datagram(rng.randbytes(rng.randint(1, 1500)), (rng.getrandbits(32), rng.getrandbits(16)))
        if kind == 6:
            return Datagram(upload(frame_id, offset, payload), (PEER[0], rng.randrange(PEER[1])))
        if kind == 7:
            # Pairs: some pass to the matcher, none go to memory.
            offset = rng.choice([CHUNK_BYTES*rng.randrange(12), rng.getrandbits(32)])
            length = rng.choice([CHUNK_BYTES, CHUNK_BYTES, 2*rng.randint(0, CHUNK_BYTES//2)])
            return Datagram(pairs(rng.choice([STREAMED, frame_id]), offset, rng.randbytes(length)))
        wild = [rng.choice([0, offset, image, rng.getrandbits(32), 0xffffffff - rng.randrange(2048)]) for _ in range(2)]
        length = rng.choice([0, length, CHUNK_BYTES, rng.randint(0, CHUNK_BYTES)])
        if self.would_fit(frame_id, wild[0], length):
            return self.datagram()
        return Datagram(upload(frame_id, wild[0], rng.randbytes(length)))

    def write(self, start: int, payload: bytes) -> None:
        """Write a chunk; the rest of its last word is undefined."""
        end, word_end = start + len(payload), start + -(-len(payload)//WORD_BYTES)*WORD_BYTES
        self.memory[start:end]   = payload
        self.known[start:end]    = b"\1"*len(payload)
        self.known[end:word_end] = bytes(word_end - end)

    def would_fit(self, frame_id: int, offset: int, length: int) -> bool:
        """Return whether the datagram is a valid chunk after all."""
        return any(frame_id == opened and (offset, length) in chunk_offsets(pixels)
                   for opened, pixels in self.open.values())


@pytest.mark.long
def test_nothing_is_written_but_chunks():
    rng  = byte_generator(DATAGRAMS)
    link = LinkBench(8*WORD_BYTES)
    link.core.reset()
    link.begin()
    hostile = Hostile(rng, link.memory(0, MEMORY_BYTES))
    for slot in range(SLOTS):
        frame_id, pixels = hostile.reopen(slot)
        link.open(slot, frame_id, pixels)
    streamed = 0
    for done in range(0, DATAGRAMS, BATCH):
        link.open_stream(STREAMED, hostile.draws("streamed"))
        link.receive([hostile.datagram() for _ in range(BATCH)], 0.2, seed=done, settle=600)
        link.set(consumed=link.get("produced"))
        streamed += link.get("offset")
        link.close_stream()
        slot = rng.randrange(SLOTS)
        link.close(slot)
        frame_id, pixels = hostile.reopen(slot)
        link.open(slot, frame_id, pixels)
        if done//BATCH % 40 == 39:
            check(link, hostile)
    check(link, hostile)
    counters = link.counters()
    print(counters)
    assert counters["datagrams_received"] == -(-DATAGRAMS//BATCH)*BATCH
    assert counters["datagrams_overrun"] == 0
    assert streamed > 0
    if DATAGRAMS >= BLOCK*BATCH:
        hostile.draws.check()
    assert all(counters[name] > 0
               for name in ("datagrams_malformed", "uploads_foreign", "uploads_unfit", "chunks_repeated"))


def check(link: LinkBench, hostile: Hostile) -> None:
    """Check every byte of memory outside the mailbox."""
    memory = link.memory(0, MEMORY_BYTES)
    wrong  = [place for place in range(MEMORY_BYTES) if hostile.known[place] and memory[place] != hostile.memory[place]]
    assert not wrong, f"{len(wrong)} bytes differ, the first at {wrong[0]:#x}"
