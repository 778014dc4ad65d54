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
    """Write messages to memory: chunks of images in their frame's slot, all others in the mailbox of the firmware.

    A chunk counts as arrived, and a message as produced, when it is in memory. Chunks of pairs go to the matcher instead.

    Parameters
    ----------
    table : SlotTable
        Frames that may be written.
    writer : StreamWriter
        Way to memory, of 32-bit items; nobody else uses it.
    mailbox_entries : int
        Messages that the mailbox holds; a power of 2, at most 128.
    gate : PairGate, optional
        Way to the matcher; without it chunks of pairs are messages as any other.
    """
    def __init__(self, table, writer, mailbox_entries=8, gate=None):
        check(2 <= mailbox_entries <= 128 and mailbox_entries & (mailbox_entries - 1) == 0,
            f"mailbox_entries must be a power of 2 from 2 to 128, not {mailbox_entries}.")
        self.sink     = stream.Endpoint(message_description())
        self.enable   = Signal()   # Off: messages are thrown away.
        # Session.
        self.token        = Signal(32) # 0: none.
        self.peer_address = Signal(32)
        self.peer_port    = Signal(16)
        # Mailbox.
        self.mailbox_base = Signal(32) # Byte address.
        self.produced     = Signal(8)  # Messages put in, modulo 256.
        self.consumed     = Signal(8)  # Messages taken out, likewise.
        # Status and events (pulses).
        self.writing      = Signal()   # A chunk is on its way to memory, in the slot `table.found`.
        self.accepted     = Signal()   # A chunk has arrived, or passed.
        self.stored       = Signal()   # It has arrived in memory.
        self.repeated     = Signal()   # A chunk had arrived before.
        self.foreign      = Signal()   # A chunk of another session or peer.
        self.unfit        = Signal()   # A chunk of no open frame.
        self.mailbox_full = Signal()   # No room for a message.

        # # #

        sink  = self.sink
        moves = Signal()
        self.comb += moves.eq(sink.valid & sink.ready)

        # Words of a message, and what a chunk's header says.
        # ---------------------------------------------------
        position     = Signal(max=MESSAGE_WORDS + 1) # Of the word that is next.
        header       = [Signal(32, name=f"header{n}") for n in range(HEADER_WORDS)]
        upload       = Signal() # The first word is a chunk's,
        pairs        = Signal() # or that of a chunk of pairs; a clock later, as memory gives the word late in its own.
        own          = Signal() # The chunk comes from the session's peer.
        rounded      = Signal(12)
        last_payload = Signal(max=MESSAGE_WORDS + 1)
        payload_ends = Signal()
        self.comb += [
            table.chunk_frame_id.eq(header[3]),
            table.chunk_offset.eq(header[4]),
            table.chunk_length.eq(header[5]),
            rounded.eq(header[5] + 3),
            payload_ends.eq(position == last_payload),
        ]
        self.sync += [
            upload.eq(sink.data[16:] == (TYPE_UPLOAD << 8 | VERSION)),
            pairs.eq((sink.data[16:] == (TYPE_PAIRS << 8 | VERSION)) & int(gate is not None)),
            If(moves,
                Case(position, {n: header[n].eq(sink.data) for n in range(1, HEADER_WORDS)}),
                position.eq(position + 1),
                If(sink.last,
                    position.eq(0)
                )
            ),
            own.eq((self.token != 0) & (header[1] == self.token)
                & (sink.address == self.peer_address) & (sink.port == self.peer_port)),
            last_payload.eq(rounded[2:] + HEADER_WORDS - 1),
        ]

        # Mailbox.
        # --------
        waiting = Signal(8)
        entry   = Signal(log2_int(mailbox_entries))
        letter  = Signal() # What is written is no chunk.
        address = Signal(32)
        passing = Signal() # What is looked at is a chunk of pairs.
        self.comb += [
            waiting.eq(self.produced - self.consumed),
            entry.eq(self.produced),
            writer.base.eq(Mux(letter, address, table.address)),
        ]
        self.sync += address.eq(self.mailbox_base + Cat(C(0, log2_int(MAILBOX_ENTRY_BYTES)), entry))

        self.fsm = fsm = FSM(reset_state="BEGIN")
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
            If(moves & sink.last,
                NextState("BEGIN")
            )
        )

        # Chunk.
        fsm.act("HEADER",
            sink.ready.eq(1),
            If(moves & (position == HEADER_WORDS - 1),
                NextState("JUDGE"),
                *[If(passing, NextState("JUDGE-PAIRS")) for _ in [gate] if gate is not None]
            )
        )
        fsm.act("JUDGE",
            table.judge.eq(1),
            If(table.judged,
                NextState("DROP"),
                If(~own,
                    self.foreign.eq(1)
                ).Elif(~table.fits,
                    self.unfit.eq(1)
                ).Elif(table.repeated,
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
            writer.sink.last.eq(payload_ends),
            sink.ready.eq(writer.sink.ready),
            If(moves & payload_ends,
                NextState("CHUNK-CRC")
            )
        )
        # The CRC reaches into one more word, whatever the length.
        fsm.act("CHUNK-CRC",
            self.writing.eq(1),
            sink.ready.eq(1),
            If(moves,
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

        # Chunk of pairs.
        if gate is not None:
            self.add_pairs(gate, own, header, moves, payload_ends)

        # Letter: who sent it and its length, then the message.
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
                NextState("LETTER")
            )
        )
        fsm.act("LETTER",
            writer.sink.valid.eq(sink.valid),
            writer.sink.data.eq(sink.data),
            writer.sink.last.eq(sink.last),
            sink.ready.eq(writer.sink.ready),
            If(moves & sink.last,
                NextState("LETTER-WRITTEN")
            )
        )
        fsm.act("LETTER-WRITTEN",
            If(writer.idle,
                NextValue(self.produced, self.produced + 1),
                NextState("BEGIN")
            )
        )
        self.comb += letter.eq(fsm.ongoing("PEER") | fsm.ongoing("LENGTH") | fsm.ongoing("LETTER")
            | fsm.ongoing("LETTER-WRITTEN"))

    def add_pairs(self, gate, own, header, moves, payload_ends):
        """States of a chunk of pairs."""
        sink, fsm = self.sink, self.fsm
        self.comb += [
            gate.chunk_frame_id.eq(header[3]),
            gate.chunk_offset.eq(header[4]),
            gate.chunk_length.eq(header[5]),
            gate.sink.data.eq(sink.data),
            gate.sink.last.eq(payload_ends),
        ]
        fsm.act("JUDGE-PAIRS",
            gate.judge.eq(1),
            If(gate.judged,
                NextState("DROP"),
                If(~own,
                    self.foreign.eq(1)
                ).Elif(gate.fits,
                    gate.begin.eq(1),
                    NextState("PAIRS")
                ).Elif(gate.repeated,
                    self.repeated.eq(1)
                ).Else(
                    self.unfit.eq(1)
                )
            )
        )
        fsm.act("PAIRS",
            gate.sink.valid.eq(sink.valid),
            sink.ready.eq(gate.sink.ready),
            If(moves & payload_ends,
                NextState("PAIRS-CRC")
            )
        )
        fsm.act("PAIRS-CRC",
            sink.ready.eq(1),
            If(moves,
                self.accepted.eq(1),
                NextState("BEGIN")
            )
        )
