#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The buffer of messages, in the frame link: datagrams that are too long, and more words than it has room for."""

from __future__ import annotations

import pytest

from litestereo.gateware.link.message import FRAME_BYTES
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, Message, MessageType
from support.limits import Draws, Range
from support.link_bench import MAILBOX_BASE, Datagram, LinkBench, with_crc
from support.pairs import byte_generator

#: As fast as a wire of one byte per clock.
WIRE_SPEED = 0.25

#: The counter of a datagram's words ends here.
COUNTED_BYTES = 4 << 12

#: Bytes of the buffer; its pointers wrap at twice as many.
BUFFER_BYTES = 4096

#: Entries of the mailbox, and bytes of one.
ENTRIES, ENTRY_BYTES = 8, 2048


@pytest.fixture(scope="module")
def link():
    return LinkBench(32)


@pytest.fixture(autouse=True)
def fresh(link):
    link.core.reset()
    link.begin()


@pytest.mark.parametrize("payload", [0, 1, 1024])
@pytest.mark.parametrize("rounds", [1, 2])
def test_longer_than_the_counter(link, payload, rounds):
    """A datagram that would be a message if its words were counted modulo 4096 is malformed, and not an overrun."""
    rng     = byte_generator(payload, rounds)
    message = Message(MessageType.CONFIGURE, payload=rng.randbytes(payload)).encode()[:-4]
    longer  = b"".join(message[:FRAME_BYTES].ljust(COUNTED_BYTES, b"\x5a") for _ in range(rounds)) + message
    link.receive([Datagram(with_crc(longer))], 1.0)
    counters = link.counters()
    assert [counters[name] for name in ("datagrams_received", "datagrams_malformed", "datagrams_overrun")] == [1, 1, 0]
    link.receive([Datagram(with_crc(message))])
    assert link.get("produced") == 1


def test_pointers_wrap(link):
    """Messages of any length, from none to the largest payload, many times as many bytes as the buffer has."""
    rng    = byte_generator(1)
    draws  = Draws(rng, {"payload": Range(0, CHUNK_BYTES)}, {"payload": [CHUNK_BYTES, 3*CHUNK_BYTES//4]})
    total  = 0
    number = 0
    while total < 16*BUFFER_BYTES:
        messages = [Message(MessageType.CONFIGURE, session=number, sequence=number + place,
                            payload=rng.randbytes(draws("payload"))).encode() for place in range(rng.randint(1, 3))]
        # Never so many that there is no room, however late memory takes them.
        link.receive(map(Datagram, messages), rng.choice([1.0, WIRE_SPEED]))
        for place, message in enumerate(messages):
            entry = link.memory(MAILBOX_BASE + (number + place) % ENTRIES*ENTRY_BYTES, 8 + len(message))
            assert entry[8:] == message, (number + place, len(message))
        number += len(messages)
        total  += sum(map(len, messages))
        assert link.get("produced") == number % 256
        link.set(consumed=number % 256)
    assert link.counters()["datagrams_overrun"] == link.counters()["datagrams_malformed"] == 0
    assert number > 4*ENTRIES
    draws.check()
