#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The frame link between datagrams and memory: chunks, mailbox, replies, bursts, and everything that does not fit."""

from __future__ import annotations

import random
import struct

import pytest

from litestereo.host_tools.protocol.messages import CHUNK_BYTES, MAX_MESSAGE_BYTES, Message, MessageType
from support.limits import Range
from support.link_bench import (
    MAILBOX_BASE,
    MAX_CHUNKS,
    PEER,
    SLOT_BYTES,
    SLOTS,
    Datagram,
    LinkBench,
    chunk_offsets,
    upload,
    with_crc,
)
from support.pairs import byte_generator

#: As fast as a wire of one byte per clock.
WIRE_SPEED = 0.25

STRANGER = (0x0a000001, 1)


@pytest.fixture(scope="module", params=[32, 128])
def link(request):
    return LinkBench(request.param)


@pytest.fixture(autouse=True)
def fresh(link):
    link.core.reset()
    link.begin()


def frame(rng: random.Random, pixels: int) -> dict[int, bytes]:
    return {offset: rng.randbytes(length) for offset, length in chunk_offsets(pixels)}


def check_memory(link: LinkBench, slot: int, chunks: dict[int, bytes]) -> None:
    memory = link.memory(slot*SLOT_BYTES, max(chunks) + CHUNK_BYTES)
    for offset, payload in chunks.items():
        assert memory[offset:offset + len(payload)] == payload, f"chunk at {offset}"


@pytest.mark.parametrize("pixels", [1, 3, 4, 1023, 1024, 1025, 3*1024 + 333, 8*1024])
def test_chunks_in_any_order_and_twice(link, pixels):
    rng    = byte_generator(pixels)
    chunks = frame(rng, pixels)
    link.open(2, 9, pixels)
    assert link.missing(2) == len(chunks)
    order = [*chunks, *rng.sample([*chunks], len(chunks))]
    rng.shuffle(order)
    link.receive([Datagram(upload(9, offset, chunks[offset])) for offset in order], WIRE_SPEED, seed=pixels)
    assert link.missing(2) == 0
    assert link.arrived(2, len(chunks)) == [True]*len(chunks)
    counters = link.counters()
    assert counters["chunks_received"] == counters["chunks_repeated"] == len(chunks)
    assert counters["datagrams_received"] == len(order)
    check_memory(link, 2, chunks)


def test_all_slots_at_once(link):
    rng    = byte_generator()
    sizes  = dict(enumerate(rng.sample(Range(1, 12*CHUNK_BYTES).ends, SLOTS)))
    frames = {slot: frame(rng, pixels) for slot, pixels in sizes.items()}
    for slot, pixels in sizes.items():
        link.open(slot, 100 + slot, pixels)
    todo = [(slot, offset) for slot, chunks in frames.items() for offset in chunks]
    rng.shuffle(todo)
    link.receive([Datagram(upload(100 + slot, offset, frames[slot][offset])) for slot, offset in todo], WIRE_SPEED)
    for slot, chunks in frames.items():
        assert link.missing(slot) == 0
        check_memory(link, slot, chunks)


def test_what_does_not_belong_is_counted_and_not_written(link):
    rng    = byte_generator()
    pixels = 2*CHUNK_BYTES + 100
    chunks = frame(rng, pixels)
    pitch  = 3*CHUNK_BYTES
    link.open(1, 5, pixels)
    link.receive([Datagram(upload(5, 0, chunks[0]))])
    before = link.memory(0, 4*SLOT_BYTES)
    full   = bytes(CHUNK_BYTES)
    unfit  = [upload(6, 1024, full), upload(5, 1, full), upload(5, 1024, full[1:]), upload(5, 2048, full),
              upload(5, 2048, bytes(99)), upload(5, 2048, bytes(101)), upload(5, 2*pitch, full),
              upload(5, 6*1024, full), upload(5, 1024, b""), upload(5, 0xfffffc00, full), upload(5, 1 << 31, full),
              upload(5, 0x400, full[:1023])]
    chunk   = upload(5, 1024, full)
    foreign = [Datagram(upload(5, 1024, full, token=0x1235)), Datagram(chunk, STRANGER),
               Datagram(chunk, (PEER[0], PEER[1] + 1)), Datagram(chunk, (PEER[0] ^ 1, PEER[1]))]
    link.receive([*map(Datagram, unfit), *foreign, Datagram(upload(5, 0, full))], WIRE_SPEED)
    counters = link.counters()
    assert (counters["uploads_unfit"], counters["uploads_foreign"], counters["chunks_repeated"]) == (12, 4, 1)
    assert link.memory(0, 4*SLOT_BYTES) == before
    assert link.arrived(1, 6) == [True] + [False]*5


def test_what_is_written_while_matching_is_counted(link):
    """Chunks written to memory count while the matcher is at work; repeated ones and other messages do not."""
    chunks = frame(byte_generator(), 3*CHUNK_BYTES)
    link.open(0, 5, 3*CHUNK_BYTES)
    for matching, some in ((1, [*chunks][:4]), (0, [*chunks][4:])):
        link.set(matching=matching)
        link.receive([*(Datagram(upload(5, offset, chunks[offset])) for offset in [*some, some[0]]),
                      Datagram(other_message(byte_generator(), 20).encode())], WIRE_SPEED)
    counters = link.counters()
    assert (counters["chunks_received"], counters["chunks_repeated"], link.get("produced")) == (6, 2, 2)
    assert counters["chunks_while_matching"] == 4


def test_what_is_sent_is_counted(link):
    link.memory(0, 5*CHUNK_BYTES)
    link.clocks(1)
    assert link.counters()["datagrams_sent"] == 5
    link.send("reply", 1, type=0x81, length=4, address=PEER[0], port=PEER[1])
    link.clocks(1)
    assert link.counters()["datagrams_sent"] == 6


def test_no_session_takes_no_chunk(link):
    link.set(token=0)
    link.open(0, 5, 100)
    link.receive([Datagram(upload(5, 0, bytes(100), token=0))])
    assert link.counters()["uploads_foreign"] == 1
    assert link.missing(0) == 2


def test_closed_and_reopened_slots(link):
    link.open(0, 5, 100)
    link.receive([Datagram(upload(5, 0, b"a"*100))])
    link.close(0)
    link.receive([Datagram(upload(5, 1024, b"b"*100))])
    assert link.counters()["uploads_unfit"] == 1
    link.open(0, 6, 100)
    assert link.arrived(0, 2) == [False, False]
    link.receive([Datagram(upload(5, 1024, b"c"*100)), Datagram(upload(6, 1024, b"d"*100))])
    assert link.counters()["uploads_unfit"] == 2
    assert link.arrived(0, 2) == [False, True]
    assert link.memory(1024, 100) == b"d"*100


def test_slot_closed_while_it_is_cleared_stays_closed(link):
    link.set(slot=3, slot_frame_id=8, slot_base=0, slot_pixels=64)
    link.set(open=1)
    link.clocks(1)
    link.set(open=0)
    assert link.get("clearing")
    link.pulse("close")
    link.clocks(2*MAX_CHUNKS)
    link.receive([Datagram(upload(8, 0, bytes(64)))])
    assert link.counters()["uploads_unfit"] == 1


def test_frame_too_large_for_the_table_takes_nothing(link):
    link.open(0, 5, MAX_CHUNKS//2*CHUNK_BYTES + 1)
    link.receive([Datagram(upload(5, 0, bytes(CHUNK_BYTES)))])
    assert link.counters()["uploads_unfit"] == 1


@pytest.mark.parametrize("damage", ["flip", "cut", "longer", "magic", "length", "mac"])
def test_damaged_datagrams_are_dropped(link, damage):
    rng     = byte_generator()
    link.open(0, 5, 10*CHUNK_BYTES)
    sound   = upload(5, 1024, rng.randbytes(CHUNK_BYTES))
    before  = link.memory(0, SLOT_BYTES)
    damaged = []
    for _ in range(300):
        data = bytearray(sound)
        if damage == "flip":
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif damage == "cut":
            data = data[:rng.randrange(1, len(data))]
        elif damage == "longer":
            data += rng.randbytes(rng.randint(1, 40))
        elif damage == "magic":
            data = bytearray(with_crc(rng.randbytes(2) + data[2:-4]))
        elif damage == "length":
            length = struct.pack("<I", rng.randrange(1 << rng.choice([10, 32])))
            data   = bytearray(with_crc(data[:20] + length + data[24:-4]))
        damaged.append(Datagram(bytes(data), error=damage == "mac"))
    link.receive(damaged, 1.0)
    counters = link.counters()
    assert counters["datagrams_received"] == counters["datagrams_malformed"] == 300
    assert link.get("produced") == 0
    assert link.memory(0, SLOT_BYTES) == before
    link.receive([Datagram(sound)])
    assert link.counters()["chunks_received"] == 1


def other_message(rng: random.Random, length: int, **fields: int) -> Message:
    """Return a message for the mailbox, with a payload of so many random bytes."""
    fields = {"session": rng.getrandbits(32), "sequence": rng.getrandbits(32)} | fields
    return Message(fields.pop("type", MessageType.CONFIGURE), payload=rng.randbytes(length), **fields)


def test_mailbox(link):
    rng      = byte_generator()
    messages = [other_message(rng, length) for length in (0, 1, 2, 3, 4, 52, 1023, 1024)]
    messages += [other_message(rng, 8, type=MessageType.UPLOAD, version=2),
                 other_message(rng, 0, type=MessageType.UPLOAD | 0x80)]
    for number, message in enumerate(messages):
        sender = (rng.getrandbits(32), rng.getrandbits(16))
        link.receive([Datagram(message.encode(), sender)], WIRE_SPEED)
        assert link.get("produced") == number + 1
        entry = link.memory(MAILBOX_BASE + number % 8*2048, 8 + MAX_MESSAGE_BYTES)
        assert struct.unpack_from("<IHH", entry) == (*sender, len(message.encode()))
        assert entry[8:8 + len(message.encode())] == message.encode()
        link.set(consumed=number + 1)


def test_mailbox_overrun_loses_the_newest(link):
    rng      = byte_generator()
    messages = [other_message(rng, 20).encode() for _ in range(11)]
    link.receive(map(Datagram, messages), WIRE_SPEED)
    assert (link.get("produced"), link.counters()["mailbox_overrun"]) == (8, 3)
    assert all(link.memory(MAILBOX_BASE + n*2048, 64)[8:8 + 48] == messages[n] for n in range(8))
    link.set(consumed=1)
    link.receive([Datagram(messages[10])])
    assert link.get("produced") == 9
    assert link.memory(MAILBOX_BASE, 64)[8:8 + 48] == messages[10]


def test_switched_off(link):
    link.set(enable=0)
    link.open(0, 5, 100)
    before = link.memory(0, SLOT_BYTES)
    link.receive([Datagram(upload(5, 0, bytes(100))), Datagram(other_message(byte_generator(), 20).encode())])
    assert (link.missing(0), link.get("produced")) == (2, 0)
    assert link.memory(0, SLOT_BYTES) == before


def test_faster_than_memory_some_are_lost_and_none_is_wrong(link):
    rng    = byte_generator()
    frames = {slot: frame(rng, 10*CHUNK_BYTES) for slot in range(SLOTS)}
    for slot in frames:
        link.open(slot, slot, 10*CHUNK_BYTES)
    datagrams = [Datagram(upload(slot, offset, payload)) for slot, chunks in frames.items()
                 for offset, payload in chunks.items()]
    link.receive(datagrams)
    counters = link.counters()
    assert counters["datagrams_overrun"] > 0
    assert counters["chunks_received"] + counters["datagrams_overrun"] == len(datagrams)
    arrived = {slot: link.arrived(slot, 20) for slot in frames}
    assert sum(map(sum, arrived.values())) == counters["chunks_received"]
    for slot, chunks in frames.items():
        check_memory(link, slot, {offset: chunks[offset] for offset in chunks if arrived[slot][offset//CHUNK_BYTES]})
    # What was lost is sent again.
    link.receive(datagrams, WIRE_SPEED)
    for slot, chunks in frames.items():
        check_memory(link, slot, chunks)


@pytest.mark.parametrize("length", [0, 1, 2, 3, 4, 5, 16, 52, 127, 1021, 1022, 1023, 1024])
def test_replies(link, length):
    rng    = byte_generator(length)
    before = link.memory(2048, CHUNK_BYTES)
    fields = {"type": 0x81} | {name: rng.getrandbits(32) for name in ("session", "sequence", "frame_id", "offset")}
    (sent,) = link.send("reply", 1, rng.choice([0.2, 0.9, 1.0]), base=2048, length=length, address=0x01020304, port=5,
                        **fields)
    assert sent.peer == (0x01020304, 5)
    assert Message.decode(sent.data) == Message(payload=before[:length], **fields)


@pytest.mark.parametrize("length", [1, 1024, 1025, 5*1024, 5*1024 + 2])
def test_bursts(link, length):
    rng    = byte_generator(length)
    link.open(0, 5, 8*CHUNK_BYTES)
    chunks = frame(rng, 8*CHUNK_BYTES)
    link.receive([Datagram(upload(5, offset, payload)) for offset, payload in chunks.items()], WIRE_SPEED)
    wanted = b"".join(chunks.values())[1024:1024 + length]
    count  = -(-length//CHUNK_BYTES)
    sent   = link.send("burst", count + 1, 0.7, type=0x87, session=1, sequence=2, frame_id=3, offset=0xffffff00,
                       base=1024, length=length, address=PEER[0], port=PEER[1])
    parts  = [Message.decode(datagram.data) for datagram in sent]
    assert [part.offset for part in parts] == [(0xffffff00 + 1024*n) & 0xffffffff for n in range(count)]
    assert b"".join(part.payload for part in parts) == wanted
    assert {(part.type, part.session, part.sequence, part.frame_id) for part in parts} == {(0x87, 1, 2, 3)}
    assert link.get("burst_busy") == 0


def test_reply_passes_burst(link):
    link.stage(type=0x87, length=10*CHUNK_BYTES, address=PEER[0], port=PEER[1])
    link.pulse("burst")
    link.clocks(5000)
    link.stage(type=0x81, length=4, address=PEER[0], port=PEER[1])
    link.pulse("reply")
    kinds = [Message.decode(datagram.data).type for datagram in link.take(11)]
    assert kinds.count(0x87) == 10
    # Words that were already read remain: one in flight, and two payloads in the queue.
    assert kinds.index(0x81) <= 4


def test_abort_of_a_burst(link):
    link.stage(type=0x87, length=40*CHUNK_BYTES, address=PEER[0], port=PEER[1])
    link.pulse("burst")
    assert len(link.take(3)) == 3
    link.pulse("abort")
    rest = link.take(40)
    assert len(rest) <= 4
    assert link.get("burst_busy") == 0
    assert [Message.decode(datagram.data).offset for datagram in rest] == [1024*(3 + n) for n in range(len(rest))]
    # An abort without a burst does not affect the next one.
    link.pulse("abort")
    assert len(link.send("burst", 6, type=0x87, length=6*CHUNK_BYTES, address=PEER[0], port=PEER[1])) == 6


def test_both_directions_at_once(link):
    rng    = byte_generator()
    pixels = 8*CHUNK_BYTES
    chunks = frame(rng, pixels)
    wanted = link.memory(SLOT_BYTES, 20*CHUNK_BYTES)
    link.open(0, 5, pixels)
    link.stage(type=0x87, base=SLOT_BYTES, length=20*CHUNK_BYTES, address=PEER[0], port=PEER[1])
    link.pulse("burst")
    link.receive([Datagram(upload(5, offset, payload)) for offset, payload in chunks.items()], WIRE_SPEED)
    assert b"".join(Message.decode(datagram.data).payload for datagram in link.take(20, 0.5)) == wanted
    check_memory(link, 0, chunks)


def test_reset_at_any_clock(link):
    rng    = byte_generator()
    pixels = 4*CHUNK_BYTES + 8
    for _ in range(30):
        chunks = frame(rng, pixels)
        link.open(0, 5, pixels)
        link.stage(type=0x87, length=20*CHUNK_BYTES, address=PEER[0], port=PEER[1])
        link.pulse("burst")
        some = rng.sample([*chunks], rng.randint(1, len(chunks)))
        link.receive([Datagram(upload(5, offset, chunks[offset])) for offset in some], rng.random(),
                     settle=rng.randint(1, 300))
        link.core.reset()
        link.begin()
        link.open(0, 6, pixels)
        link.receive([Datagram(upload(6, offset, payload)) for offset, payload in chunks.items()], WIRE_SPEED)
        assert link.missing(0) == 0
        check_memory(link, 0, chunks)
