#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Streamed frames in the frame link: pairs in order, parts of the map back, and everything that does not fit."""

from __future__ import annotations

import pytest

from litestereo.host_tools.protocol.messages import CHUNK_BYTES, REPLY, Message, MessageType
from support.link_bench import PEER, SLOT_BYTES, Datagram, LinkBench, chunk_offsets, pairs, upload
from support.pairs import byte_generator

#: As fast as a wire of one byte per clock.
WIRE_SPEED = 0.25

STRANGER = (0x0a000001, 1)


@pytest.fixture(scope="module")
def link():
    return LinkBench(32)


@pytest.fixture(autouse=True)
def fresh(link):
    link.core.reset()
    link.begin()
    link.set(slow=0)


def chunks_of(data: bytes) -> dict[int, bytes]:
    return {offset: data[offset:offset + CHUNK_BYTES] for offset in range(0, len(data), CHUNK_BYTES)}


def send(link: LinkBench, frame_id: int, chunks: dict[int, bytes], **options) -> None:
    link.receive([Datagram(pairs(frame_id, offset, chunk)) for offset, chunk in chunks.items()], WIRE_SPEED, **options)


def check_parts(datagrams: list[Datagram], chunks: dict[int, bytes], frame_id: int, sequence: int) -> list[int]:
    """Return the offsets of the received parts, and check all else in them."""
    offsets = []
    for datagram in datagrams:
        message = Message.decode(datagram.data)
        assert datagram.peer == PEER
        assert (message.type, message.session, message.sequence, message.frame_id) == (
            MessageType.READ | REPLY, 0x1234, sequence, frame_id)
        assert message.payload == chunks[message.offset]
        offsets.append(message.offset)
    return offsets


@pytest.mark.parametrize("pixels", [1, 2, 3, 511, 512, 513, 2*512 + 77, 4*512])
@pytest.mark.parametrize("slow", [0, 0b1010])
def test_pairs_pass_and_the_map_comes_back(link, pixels, slow):
    chunks = chunks_of(byte_generator(pixels).randbytes(2*pixels))
    link.set(slow=slow)
    link.open_stream(7, pixels, sequence=99)
    assert (link.get("opened"), link.get("offset")) == (1, 0)
    send(link, 7, chunks, settle=20000)
    assert (link.get("opened"), link.get("offset")) == (0, 2*pixels)
    assert link.get("sending")
    assert check_parts(link.take(len(chunks), 0.5), chunks, 7, 99) == [*chunks]
    assert not link.get("sending")
    assert link.counters()["chunks_received"] == len(chunks)


def test_parts_that_find_no_room_are_omitted_and_the_pairs_still_pass(link):
    chunks = chunks_of(byte_generator().randbytes(11*CHUNK_BYTES - 6))
    link.open_stream(7, 11*512 - 3)
    # Meanwhile nothing is sent.
    send(link, 7, chunks)
    assert not link.get("opened")
    assert check_parts(link.take(20), chunks, 7, 1) == [*chunks][:4]
    # The next frame has all the room again.
    link.open_stream(8, 512)
    send(link, 8, {0: chunks[1024]})
    assert check_parts(link.take(20), {0: chunks[1024]}, 8, 1) == [0]


def test_only_the_next_chunk_fits(link):
    chunks = chunks_of(byte_generator().randbytes(3*CHUNK_BYTES + 10))
    full   = bytes(CHUNK_BYTES)
    link.open_stream(7, 3*512 + 5)
    link.receive([Datagram(pairs(7, 0, chunks[0]))])
    unfit    = [pairs(7, 2048, full), pairs(7, 3072, bytes(10)), pairs(7, 1024, full[:1023]), pairs(7, 1024, b""),
                pairs(7, 1, full), pairs(7, 4096, full), pairs(8, 1024, full), pairs(8, 0, full),
                pairs(7, 0xfffffc00, full), upload(7, 0, full), upload(7, 1024, full)]
    foreign  = [Datagram(pairs(7, 1024, full, token=0x1235)), Datagram(pairs(7, 1024, full), STRANGER),
                Datagram(pairs(7, 1024, full), (PEER[0], PEER[1] + 1))]
    link.receive([*map(Datagram, unfit), *foreign, Datagram(pairs(7, 0, full))], WIRE_SPEED)
    counters = link.counters()
    assert (counters["uploads_unfit"], counters["uploads_foreign"], counters["chunks_repeated"]) == (11, 3, 1)
    assert link.get("offset") == 1024
    del chunks[0]
    order = [(2048, full), (1024, chunks[1024]), (3072, full), (2048, chunks[2048]), (3072, full[:12]),
             (3072, chunks[3072]), (3072, chunks[3072])]
    link.receive([Datagram(pairs(7, offset, chunk)) for offset, chunk in order], WIRE_SPEED)
    counters = link.counters()
    assert (counters["uploads_unfit"], counters["chunks_repeated"], counters["chunks_received"]) == (14, 2, 4)
    assert check_parts(link.take(20)[1:], chunks, 7, 1) == [*chunks]


def test_nothing_fits_when_no_stream_is_open(link):
    link.receive([Datagram(pairs(0, 0, bytes(CHUNK_BYTES)))])
    assert link.counters()["uploads_unfit"] == 1
    assert link.counters()["mailbox_overrun"] == link.get("produced") == 0


@pytest.mark.parametrize("clocks", [*range(1, 60, 7), *range(60, 900, 97)])
def test_closed_at_any_clock(link, clocks):
    rng    = byte_generator(clocks)
    chunks = chunks_of(rng.randbytes(6*CHUNK_BYTES))
    link.set(slow=0b0001)
    link.open_stream(7, 6*512)
    send(link, 7, chunks, settle=clocks)
    link.pulse("stream_close")
    assert not link.get("opened")
    link.clocks(3000)
    # At most the part remains that was already being sent.
    assert len(check_parts(link.take(20), chunks, 7, 1)) <= 1
    assert not link.get("sending")
    before = link.counters()
    send(link, 7, chunks)
    after = link.counters()
    assert after["chunks_received"] == before["chunks_received"]
    # The previous frame does not affect the next one.
    fresh = chunks_of(rng.randbytes(2*CHUNK_BYTES + 2))
    link.open_stream(9, 2*512 + 1, sequence=5)
    send(link, 9, fresh)
    assert check_parts(link.take(20), fresh, 9, 5) == [*fresh]


def test_reopened_while_a_chunk_is_passing(link):
    rng    = byte_generator()
    chunks = chunks_of(rng.randbytes(3*CHUNK_BYTES))
    link.set(slow=0b1111)
    link.open_stream(7, 3*512)
    link.receive([Datagram(pairs(7, 0, chunks[0]))], settle=100)
    link.clocks(500)
    assert link.get("offset") == CHUNK_BYTES and link.counters()["chunks_received"] == 0
    link.pulse("stream_close")
    link.open_stream(8, 3*512)
    send(link, 8, chunks, settle=20000)
    assert check_parts(link.take(20), chunks, 8, 1) == [*chunks]


def test_replies_bursts_and_uploads_meanwhile(link):
    rng    = byte_generator()
    chunks = chunks_of(rng.randbytes(4*CHUNK_BYTES))
    wanted = link.memory(SLOT_BYTES, 6*CHUNK_BYTES)
    pixels = 2*CHUNK_BYTES
    stored = {offset: rng.randbytes(length) for offset, length in chunk_offsets(pixels)}
    link.open(0, 5, pixels)
    link.open_stream(7, 4*512)
    link.stage(type=0x87, frame_id=3, base=SLOT_BYTES, length=6*CHUNK_BYTES, address=PEER[0], port=PEER[1])
    link.pulse("burst")
    link.stage(type=0x86, frame_id=4, base=SLOT_BYTES, length=16, address=PEER[0], port=PEER[1])
    link.pulse("reply")
    mixed = [Datagram(upload(5, offset, chunk)) for offset, chunk in stored.items()]
    for place, (offset, chunk) in enumerate(chunks.items()):
        mixed.insert(2*place, Datagram(pairs(7, offset, chunk)))
    link.receive(mixed, WIRE_SPEED)
    assert link.missing(0) == 0
    sent = link.take(20, 0.7)
    by_frame = {frame_id: [datagram for datagram in sent if Message.decode(datagram.data).frame_id == frame_id]
                for frame_id in (3, 4, 7)}
    assert b"".join(Message.decode(datagram.data).payload for datagram in by_frame[3]) == wanted
    assert len(by_frame[4]) == 1
    assert check_parts(by_frame[7], chunks, 7, 1) == [*chunks]
    # They alternate: neither burst nor map waits for the end of the other.
    order = [Message.decode(datagram.data).frame_id for datagram in sent]
    assert sum(before != after for before, after in zip(order, order[1:], strict=False)) >= 6


def test_reset_at_any_clock(link):
    rng = byte_generator()
    for _ in range(20):
        chunks = chunks_of(rng.randbytes(4*CHUNK_BYTES))
        link.set(slow=rng.randrange(4))
        link.open_stream(7, 4*512)
        send(link, 7, chunks, settle=rng.randint(1, 400))
        link.take(rng.randint(0, 2))
        link.core.reset()
        link.begin()
        link.set(slow=0)
        link.open_stream(6, 4*512)
        send(link, 6, chunks)
        assert check_parts(link.take(20), chunks, 6, 1) == [*chunks]
