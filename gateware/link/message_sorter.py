#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

# Message Sorter -----------------------------------------------------------------------------------

class MessageSorter(LiteXModule):
    """Write messages to memory: chunks of images to the slot of their frame, all others to the mailbox of the firmware.

    A chunk counts as arrived, and a message as produced, once it is in memory. Chunks of pairs go to the matcher
    instead.

        BEGIN ── SORT ─┬─ DROP
                       ├─ HEADER ── JUDGE ─────── CHUNK ── CHUNK-CRC ── CHUNK-WRITTEN      chunk of an image
                       ├─ HEADER ── JUDGE-PAIRS ─ PAIRS ── PAIRS-CRC                       chunk of pairs
                       └─ PEER ──── LENGTH ────── MAILBOX ── MAILBOX-WRITTEN               any other message

    Each path ends in BEGIN; a chunk that is not wanted goes from JUDGE or JUDGE-PAIRS to DROP.

    It is reset with its clock domain alone.

    Parameters
    ----------
    table : SlotTable
        Frames that may be written.
    writer : StreamWriter
        Writer to memory, of 32-bit items, for this core alone.
    mailbox_entries : int
        Messages that the mailbox holds; a power of 2 from 2 to 128.
    gate : PairGate, optional
        Path to the matcher; without it chunks of pairs are messages like any other.
    """
    def __init__(self, table, writer, mailbox_entries=8, gate=None):
        check(2 <= mailbox_entries <= 128 and mailbox_entries & (mailbox_entries - 1) == 0,
            f"mailbox_entries must be a power of 2 from 2 to 128, not {mailbox_entries}.")
        self.sink    = stream.Endpoint(message_description()) # Messages, whole and checked.
        self.enable  = Signal() # Off: messages are discarded.
        self.latency = None     # Depends on memory, and for chunks of pairs on the matcher.
        # Session.
        self.token        = Signal(32) # Token of the session; 0: there is none.
        self.peer_address = Signal(32) # IPv4 address of its peer.
        self.peer_port    = Signal(16) # UDP port of its peer.
        # Mailbox.
        self.mailbox_base = Signal(32) # Byte address.
        self.produced     = Signal(8)  # Messages put in, modulo 256.
        self.consumed     = Signal(8)  # Messages taken out, modulo 256.
        # Status and events (pulses).
        self.writing      = Signal()   # A chunk is on its way to memory, to the slot `table.found`.
        self.accepted     = Signal()   # A chunk has arrived in memory, or has passed to the matcher.
        self.stored       = Signal()   # A chunk has arrived in memory.
        self.repeated     = Signal()   # A chunk has come before.
        self.foreign      = Signal()   # A chunk of another session or peer.
        self.unfit        = Signal()   # A chunk of no open frame.
        self.mailbox_full = Signal()   # No room for a message.

        # # #

        self.moves        = Signal()                      # A word is taken.
        self.position     = Signal(max=MESSAGE_WORDS + 1) # Number of that word in its message.
        self.header       = [Signal(32, name=f"header{n}") for n in range(HEADER_WORDS)] # Of a chunk, but for word 0.
        self.own          = Signal()                      # The chunk comes from the session's peer.
        self.payload_ends = Signal()                      # The word is the last of the payload.
        self.fsm          = FSM(reset_state="BEGIN")

        self.add_header()
        self.add_kinds(writer, mailbox_entries, gate)
        self.add_chunk(table, writer)
        if gate is not None:
            self.add_pairs(gate)
        self.add_mailbox(table, writer, mailbox_entries)

    def add_header(self):
        """Count the words of a message, and keep the header of a chunk."""
        sink         = self.sink
        rounded      = Signal(12)
        last_payload = Signal(max=MESSAGE_WORDS + 1)
        self.comb += [
            self.moves.eq(sink.valid & sink.ready),
            rounded.eq(self.header[5] + 3),
            self.payload_ends.eq(self.position == last_payload),
        ]
        self.sync += [
            If(self.moves,
                Case(self.position, {n: self.header[n].eq(sink.data) for n in range(1, HEADER_WORDS)}),
                self.position.eq(self.position + 1),
                If(sink.last,
                    self.position.eq(0)
                )
            ),
            self.own.eq((self.token != 0) & (self.header[1] == self.token)
                & (sink.address == self.peer_address) & (sink.port == self.peer_port)),
            last_payload.eq(rounded[2:] + HEADER_WORDS - 1),
        ]

    def add_kinds(self, writer, mailbox_entries, gate):
        """Add the states that tell what a message is, and the one that discards it."""
        sink, fsm = self.sink, self.fsm
        # Both flags are registered, because the word comes late in its clock from block RAM.
        upload  = Signal()  # The first word is that of a chunk of an image,
        pairs   = Signal()  # or of a chunk of pairs.
        passing = Signal()  # The message under way is a chunk of pairs.
        waiting = Signal(8) # Messages in the mailbox.
        self.comb += waiting.eq(self.produced - self.consumed)
        self.sync += [
            upload.eq(sink.data[16:] == (TYPE_UPLOAD << 8 | VERSION)),
            pairs.eq((sink.data[16:] == (TYPE_PAIRS << 8 | VERSION)) & int(gate is not None)),
        ]
        fsm.act("BEGIN",
            If(sink.valid,
                NextState("SORT")
            )
        )
        fsm.act("SORT",
            If(~self.enable,
                NextState("DROP")
            ).Elif(upload | pairs,
                NextValue(passing, pairs),
                NextState("HEADER")
            ).Elif(waiting >= mailbox_entries,
                self.mailbox_full.eq(1),
                NextState("DROP")
            ).Else(
                writer.start.eq(1),
                NextState("PEER")
            )
        )
        fsm.act("DROP",
            sink.ready.eq(1),
            If(self.moves & sink.last,
                NextState("BEGIN")
            )
        )
        judge = NextState("JUDGE")
        if gate is not None:
            judge = If(passing, NextState("JUDGE-PAIRS")).Else(NextState("JUDGE"))
        fsm.act("HEADER",
            sink.ready.eq(1),
            If(self.moves & (self.position == HEADER_WORDS - 1), judge)
        )

    def add_chunk(self, table, writer):
        """Add the states of a chunk of an image: judge it, write its payload, mark it as arrived."""
        sink, fsm = self.sink, self.fsm
        self.comb += table.chunk.ask(self.header)
        fsm.act("JUDGE",
            table.chunk.judge.eq(1),
            If(table.chunk.judged,
                NextState("DROP"),
                If(~self.own,
                    self.foreign.eq(1)
                ).Elif(~table.chunk.fits,
                    self.unfit.eq(1)
                ).Elif(table.chunk.repeated,
                    self.repeated.eq(1)
                ).Else(
                    writer.start.eq(1),
                    NextState("CHUNK")
                )
            )
        )
        fsm.act("CHUNK",
            self.writing.eq(1),
            writer.sink.valid.eq(sink.valid),
            writer.sink.data.eq(sink.data),
            writer.sink.last.eq(self.payload_ends),
            sink.ready.eq(writer.sink.ready),
            If(self.moves & self.payload_ends,
                NextState("CHUNK-CRC")
            )
        )
        # The CRC ends in the word after the payload's last, for any length.
        fsm.act("CHUNK-CRC",
            self.writing.eq(1),
            sink.ready.eq(1),
            If(self.moves,
                NextState("CHUNK-WRITTEN")
            )
        )
        fsm.act("CHUNK-WRITTEN",
            self.writing.eq(1),
            If(writer.idle,
                table.set.eq(1),
                self.accepted.eq(1),
                self.stored.eq(1),
                NextState("BEGIN")
            )
        )

    def add_pairs(self, gate):
        """Add the states of a chunk of pairs: judge it, let its payload pass to the matcher."""
        sink, fsm = self.sink, self.fsm
        self.comb += [
            *gate.chunk.ask(self.header),
            gate.sink.data.eq(sink.data),
            gate.sink.last.eq(self.payload_ends),
        ]
        fsm.act("JUDGE-PAIRS",
            gate.chunk.judge.eq(1),
            If(gate.chunk.judged,
                NextState("DROP"),
                If(~self.own,
                    self.foreign.eq(1)
                ).Elif(gate.chunk.fits,
                    gate.begin.eq(1),
                    NextState("PAIRS")
                ).Elif(gate.chunk.repeated,
                    self.repeated.eq(1)
                ).Else(
                    self.unfit.eq(1)
                )
            )
        )
        fsm.act("PAIRS",
            gate.sink.valid.eq(sink.valid),
            sink.ready.eq(gate.sink.ready),
            If(self.moves & self.payload_ends,
                NextState("PAIRS-CRC")
            )
        )
        fsm.act("PAIRS-CRC",
            sink.ready.eq(1),
            If(self.moves,
                self.accepted.eq(1),
                NextState("BEGIN")
            )
        )

    def add_mailbox(self, table, writer, mailbox_entries):
        """Add the states of any other message: write its sender and its length to the mailbox, then the message."""
        sink, fsm = self.sink, self.fsm
        to_mailbox = Signal()                          # What is written goes to the mailbox,
        entry      = Signal(log2_int(mailbox_entries)) # to this entry,
        address    = Signal(32)                        # whose byte address this is.
        self.comb += [
            entry.eq(self.produced),
            writer.base.eq(Mux(to_mailbox, address, table.address)),
        ]
        self.sync += address.eq(self.mailbox_base + Cat(C(0, log2_int(MAILBOX_ENTRY_BYTES)), entry))
        fsm.act("PEER",
            writer.sink.valid.eq(1),
            writer.sink.data.eq(sink.address),
            If(writer.sink.ready,
                NextState("LENGTH")
            )
        )
        fsm.act("LENGTH",
            writer.sink.valid.eq(1),
            writer.sink.data.eq(Cat(sink.port, sink.bytes)),
            If(writer.sink.ready,
                NextState("MAILBOX")
            )
        )
        fsm.act("MAILBOX",
            writer.sink.valid.eq(sink.valid),
            writer.sink.data.eq(sink.data),
            writer.sink.last.eq(sink.last),
            sink.ready.eq(writer.sink.ready),
            If(self.moves & sink.last,
                NextState("MAILBOX-WRITTEN")
            )
        )
        fsm.act("MAILBOX-WRITTEN",
            If(writer.idle,
                NextValue(self.produced, self.produced + 1),
                NextState("BEGIN")
            )
        )
        self.comb += to_mailbox.eq(
            fsm.ongoing("PEER") | fsm.ongoing("LENGTH") | fsm.ongoing("MAILBOX") | fsm.ongoing("MAILBOX-WRITTEN"))
