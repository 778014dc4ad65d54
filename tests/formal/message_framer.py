#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MessageFramer: a message and its payload become one datagram, of the length that it announces."""

from __future__ import annotations

from litex.gen import LiteXModule
from migen import If, Signal

from litestereo.gateware.link.message import CHUNK_BYTES, FRAME_BYTES, HEADER_WORDS
from litestereo.gateware.link.message_framer import MessageFramer

from .proof import Proof, inside, smaller
from .streams import counted, feed, stays, taken


class AnyCRC(LiteXModule):
    """A CRC of any value: no promise may depend on it."""

    def __init__(self) -> None:
        self.reset, self.ce, self.error = Signal(), Signal(), Signal()
        self.data, self.be, self.value  = Signal(32), Signal(4), Signal(32)
        self.any = Signal(32)
        self.sync += If(self.ce | self.reset, self.value.eq(self.any))
        self.comb += self.error.eq(self.value[0])


def message_framer(make=MessageFramer) -> Proof:
    """Prove messages of any length, one after the other; payload and receiver may stall at any time."""
    core         = smaller(make, SumCRC=AnyCRC)(1234)
    proof        = Proof(core)
    sink, source = core.sink, core.source
    feed(proof, sink)
    feed(proof, core.payload)
    proof.free(source.ready, core.crc.any)
    proof.assume("payloads are of a chunk at most", sink.length <= CHUNK_BYTES)

    word    = counted(proof, taken(source), taken(source) & source.last, 10)
    payload = counted(proof, taken(core.payload), taken(source) & source.last, 10)
    rounded = Signal(12)
    words   = Signal(10)
    total   = Signal(10)
    bytes   = Signal(12)
    proof.comb += [
        rounded.eq(sink.length + 3),
        words.eq(rounded[2:]),
        total.eq(words + HEADER_WORDS + 1),
        bytes.eq(sink.length + FRAME_BYTES),
    ]
    header    = [sink.session, sink.sequence, sink.frame_id, sink.offset, sink.length]
    in_header = word < HEADER_WORDS
    last      = word == total - 1
    whole     = (word >= HEADER_WORDS) & (word + 2 < total)
    proof.prove("what is offered stays", stays(proof, source))
    proof.prove("nothing without a message", ~source.valid | sink.valid)
    proof.prove("the last word, and no other, is marked", ~source.valid | (source.last == last))
    proof.prove("a message is taken with its last word", taken(sink) == (taken(source) & source.last))
    proof.prove("and counted", core.sent == taken(sink))
    proof.prove("no word beyond the last", word < total)
    proof.prove("words of the payload are sent when they are taken", ~taken(core.payload)
                | (taken(source) & ~in_header & ~last))
    proof.prove("all of them, and no more", ~taken(sink) | (payload == words))
    proof.prove("the payload passes unchanged", ~source.valid | ~whole | (source.data == core.payload.data))
    proof.prove("the header is the message's", ~source.valid | (word == 0) | ~in_header | (source.data == sum(
        ((word == n)*field for n, field in enumerate(header, 1)), start=0)))
    proof.prove("the last byte is marked", ~source.valid | ~source.last
                | (source.last_be == 1 << ((bytes - 1) & 3)))
    proof.prove("the datagram's length is announced", ~source.valid | (source.length == bytes))
    proof.reach("two messages, one without a payload", (counted(proof, taken(sink) & (sink.length == 0), 0, 2) == 1)
                & (counted(proof, taken(sink) & (sink.length == 5), 0, 2) == 1))
    # Invariants, for the induction.
    fsm, position, end = core.fsm, inside(core, "position")[0], inside(core, "last_word")[0]
    state = {name: fsm.state == number for name, number in fsm.encoding.items()}
    proof.prove("five states", fsm.state < 5)
    proof.prove("a message is under way", state["IDLE"] | sink.valid)
    proof.prove("its last word but one", state["IDLE"] | (end == total - 2))
    proof.prove("idle between two", ~state["IDLE"] | ((word == 0) & (payload == 0)))
    proof.prove("position counts words", ~state["WORDS"] | ((position == word) & (word <= end)))
    proof.prove("the last words", ~(state["SUM"] | state["TAIL"]) | ((word == end) & (position == end)))
    proof.prove("the CRC is the last", ~state["CRC"] | (word == end + 1))
    proof.prove("the CRC is finished by then", ~(state["TAIL"] | state["CRC"]) | ~inside(core, "counts")[0])
    held = Signal(10)
    proof.comb += held.eq(word - HEADER_WORDS)
    proof.prove("payload is counted", (payload == 0) | state["CRC"] | (payload == held))
    proof.prove("from the header's end on", state["CRC"] | ((payload == 0) == (word <= HEADER_WORDS)))
    proof.prove("with the CRC all is there", ~state["CRC"] | (payload == words))
    proof.prove("the word that ends the payload is there",
                ~(state["SUM"] | state["TAIL"]) | (words == 0) | core.payload.valid)
    return proof
