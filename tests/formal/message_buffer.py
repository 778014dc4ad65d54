#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MessageBuffer: messages come out whole, and no waiting word is overwritten."""

from __future__ import annotations

from migen import Signal

from litestereo.gateware.link import message
from litestereo.gateware.link.message_buffer import MessageBuffer

from .message_framer import AnyCRC
from .proof import Proof, inside, smaller
from .streams import counted, feed, stays, taken

BYTES = message.FRAME_BYTES + 4
WORDS = 16


def message_buffer(make=MessageBuffer) -> Proof:
    """Prove datagrams of any contents and length, with payloads of up to four bytes, and correct or wrong CRCs."""
    core = smaller(make, CheckCRC=AnyCRC, MESSAGE_BYTES=BYTES, MESSAGE_WORDS=BYTES//4)(words=WORDS, messages=2)
    proof        = Proof(core)
    sink, source = core.sink, core.source
    feed(proof, sink)
    proof.free(source.ready, core.crc.any)
    begin, position, first = (inside(core, name)[0] for name in ("begin", "position", "taken"))
    whole   = Signal(5)
    waiting = Signal(5)
    proof.comb += [whole.eq(position - first), waiting.eq(begin - first)]
    word  = counted(proof, taken(source), taken(source) & source.last, 10)
    total = Signal(10)
    proof.comb += total.eq((source.bytes + 3) >> 2)
    proof.prove("what is offered stays", stays(proof, source))
    proof.prove("never more words than there is room for", (whole <= WORDS) & (waiting <= whole))
    proof.prove("a message has its words, the last one marked", ~source.valid | (source.last == (word == total - 1)))
    proof.prove("and is there as a whole", ~source.valid | (waiting >= total - word))
    proof.prove("it has the size of a message", ~source.valid | ((source.bytes >= message.FRAME_BYTES)
                                                                 & (source.bytes <= BYTES)))
    proof.prove("a message that is kept finds room in the FIFO", ~core.fifo.sink.valid | core.fifo.sink.ready)
    proof.prove("an end is one of three: kept, malformed, overrun",
                core.received == (core.fifo.sink.valid + core.malformed + core.overrun))
    writes = inside(core, "moves_in")[0] & inside(core, "room")[0]
    proof.prove("no word that waits is written over", ~writes | (whole < WORDS))
    proof.reach("a message comes out", taken(source) & source.last)
    return proof
