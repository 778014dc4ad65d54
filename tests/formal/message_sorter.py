#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MessageSorter: it writes only accepted chunks, and messages that have a place in the mailbox."""

from __future__ import annotations

from types import SimpleNamespace

from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Cat, If, Mux, Signal

from litestereo.gateware.link.chunk_check import ChunkCheck
from litestereo.gateware.link.message import FRAME_BYTES, HEADER_WORDS, MAILBOX_ENTRY_BYTES, MESSAGE_BYTES
from litestereo.gateware.link.message_sorter import MessageSorter

from .proof import Proof
from .streams import counted, feed, stays, taken

ENTRIES = 2


class Writer(LiteXModule):
    """A StreamWriter, as the sorter sees it."""

    def __init__(self) -> None:
        self.sink = stream.Endpoint([("data", 32)])
        self.base, self.start, self.idle = Signal(32), Signal(), Signal(reset=1)


def message_sorter(make=MessageSorter) -> Proof:
    """Prove messages of any kind and length, whole as MessageBuffer delivers them, with any verdict on a chunk."""
    writer = Writer()
    table  = SimpleNamespace(chunk=ChunkCheck(), address=Signal(32, name="table_address"), set=Signal(name="table_set"))
    chunk  = table.chunk
    core   = make(table, writer, mailbox_entries=ENTRIES)
    proof  = Proof(core)
    sink   = core.sink
    feed(proof, sink)
    mailbox = proof.constant(32)
    proof.comb += core.mailbox_base.eq(mailbox)
    proof.free(core.enable, core.token, core.peer_address, core.peer_port, core.consumed, chunk.judged, chunk.fits,
               chunk.repeated, table.address, writer.sink.ready, writer.idle)

    # A message has as many bytes as its header announces.
    word  = counted(proof, taken(sink), taken(sink) & sink.last, 10)
    words = Signal(10)
    proof.comb += words.eq((sink.bytes + 3) >> 2)
    proof.assume("a message is whole", (sink.bytes >= FRAME_BYTES) & (sink.bytes <= MESSAGE_BYTES)
                 & (sink.last == (word == words - 1)))
    proof.assume("its bytes and sender stay", (word == 0) | (Cat(sink.bytes, sink.address, sink.port)
                 == proof.past(sender(proof, sink))))
    proof.assume("its header has its length", ~sink.valid | (word != HEADER_WORDS - 1)
                 | (sink.data == sink.bytes - FRAME_BYTES))
    # SlotTable and StreamWriter, as they are proven elsewhere.
    proof.assume("a verdict stays until the next", proof.past(chunk.judge & ~chunk.judged) | ~proof.started
                 | (table.address == proof.past(table.address)))
    proof.assume("verdicts come when asked for", ~chunk.judged | chunk.judge)
    proof.assume("an empty chunk does not fit", ~chunk.fits | (chunk.length != 0))
    # The firmware removes messages from the mailbox.
    waits  = Signal(8)
    waited = Signal(8)
    read   = Signal(8)
    proof.comb += [waits.eq(core.produced - core.consumed), read.eq(core.consumed - proof.past(core.consumed)),
                   waited.eq(core.produced - proof.past(core.consumed))]
    proof.assume("the firmware takes what is there", Mux(proof.started, read <= waited, core.consumed == 0))

    # The current block: its kind, and the words that were written.
    begin  = writer.start
    active     = Signal()
    to_mailbox = Signal()
    length     = Signal(10)
    allowed    = Signal(32)
    given      = counted(proof, taken(writer.sink), begin, 10)
    proof.sync += [
        If(begin,
            active.eq(1),
            to_mailbox.eq(~chunk.judge),
            length.eq(Mux(chunk.judge, words - HEADER_WORDS - 1, words + 2)),
            allowed.eq(table.address)
        ).Elif(active & writer.idle,
            active.eq(0)
        ),
    ]
    ended = Signal()
    proof.sync += If(taken(writer.sink) & writer.sink.last, ended.eq(1)).Elif(begin, ended.eq(0))
    proof.assume("the writer is idle without a block, and in one until its last word",
                 Mux(active, ~writer.idle | ended, writer.idle))
    proof.assume("it takes words in a block alone", ~writer.sink.ready | (active & ~ended))
    entry = Signal(32)
    proof.comb += entry.eq(mailbox + MAILBOX_ENTRY_BYTES*core.produced[0])
    proof.prove("what is offered to memory stays", stays(proof, writer.sink))
    proof.prove("a block begins when none is under way", ~begin | (writer.idle & ~active))
    proof.prove("a chunk is written when it fits and has not come before", ~begin | ~chunk.judge
                | (chunk.judged & chunk.fits & ~chunk.repeated & (proof.past(core.token) != 0)))
    proof.prove("a chunk goes to its place", ~active | to_mailbox | (writer.base == allowed))
    proof.prove("any other message to the next entry of the mailbox", ~active | ~to_mailbox | (writer.base == entry))
    proof.prove("the mailbox never overflows", (waits <= ENTRIES) & (~active | ~to_mailbox | (waits < ENTRIES)))
    proof.prove("a message stays in its entry", ~active | ~to_mailbox | ~writer.sink.valid
                | (given < MAILBOX_ENTRY_BYTES//4))
    proof.prove("blocks end with their last word", ~active | ~writer.sink.valid
                | (writer.sink.last == (given == length - 1)))
    proof.prove("no word outside of a block", ~writer.sink.valid | active)
    proof.prove("a chunk is marked when it is in memory", ~table.set | (~to_mailbox & ended & writer.idle))
    proof.reach("a chunk is in memory", table.set)
    proof.reach("a message is in the mailbox", core.produced == 1)
    return proof


def sender(proof: Proof, sink: stream.Endpoint) -> Signal:
    """Return bytes and sender of a message as one signal."""
    signal = Signal(len(sink.bytes) + len(sink.address) + len(sink.port))
    proof.comb += signal.eq(Cat(sink.bytes, sink.address, sink.port))
    return signal
