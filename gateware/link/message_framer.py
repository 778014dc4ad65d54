#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common     import *
from .message     import *
from .message_crc import MessageCRC

# Message Framer -----------------------------------------------------------------------------------

@ResetInserter()
class MessageFramer(LiteXModule):
    """Put messages together: header, payload and CRC, as datagrams.

    Between the first and the last word of a datagram two clocks are lost, before the word that the CRC begins in.
    """
    def __init__(self, port):
        self.sink    = stream.Endpoint(job_layout())           # Messages; `base` is not looked at.
        self.payload = stream.Endpoint([("data", 32)])         # Their payloads, whole words each.
        self.source  = stream.Endpoint(datagram_description()) # Datagrams, from UDP port `port`.
        self.sent    = Signal()                                # A datagram has left (pulse).

        # # #

        sink, source = self.sink, self.source

        # Words of header and payload.
        # ----------------------------
        header = [
            Cat(C(MAGIC, 16), C(VERSION, 8), sink.type),
            sink.session,
            sink.sequence,
            sink.frame_id,
            sink.offset,
            sink.length,
        ]
        position  = Signal(max=MESSAGE_WORDS)
        rounded   = Signal(12)
        last_word = Signal(max=MESSAGE_WORDS)
        word      = Signal(32)
        there     = Signal()
        in_header = Signal()
        self.comb += [
            rounded.eq(sink.length + 3),
            in_header.eq(position < HEADER_WORDS),
            word.eq(self.payload.data),
            Case(position, {n: word.eq(value) for n, value in enumerate(header)}),
            there.eq(in_header | self.payload.valid),
        ]

        # CRC, a clock behind the words.
        # ------------------------------
        tail    = Signal(3)  # Bytes in the last word of the payload, or of the header if there is none.
        held    = Signal(32)
        advance = Signal()   # The word counts.
        counts  = Signal()   # The word that is held does.
        summed  = Signal(32)
        self.crc = crc = MessageCRC()
        self.comb += [
            Case(sink.length[:2], {
                1:         [tail.eq(1), crc.be.eq(1)],
                2:         [tail.eq(2), crc.be.eq(2)],
                3:         [tail.eq(3), crc.be.eq(4)],
                "default": [tail.eq(4), crc.be.eq(8)],
            }),
            crc.data.eq(held),
            crc.ce.eq(counts),
            summed.eq(crc.value),
        ]
        self.sync += [
            held.eq(word),
            counts.eq(advance),
        ]
        # By `tail`: the last word of the payload filled up with CRC, and the rest of the CRC.
        filled = {1: Cat(word[:8], summed[:24]), 2: Cat(word[:16], summed[:16]), 3: Cat(word[:24], summed[:8]), 4: word}
        rest   = {1: summed[24:], 2: summed[16:], 3: summed[8:], 4: summed}
        marks  = {1: 0b0001, 2: 0b0010, 3: 0b0100, 4: 0b1000}

        # Datagram.
        # ---------
        self.comb += [
            source.src_port.eq(port),
            source.dst_port.eq(sink.port),
            source.ip_address.eq(sink.address),
            source.length.eq(sink.length + FRAME_BYTES),
        ]
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            crc.reset.eq(1),
            NextValue(position, 0),
            NextValue(last_word, rounded[2:] + HEADER_WORDS - 1),
            If(sink.valid,
                NextState("WORDS")
            )
        )
        fsm.act("WORDS",
            source.valid.eq(there),
            source.data.eq(word),
            If(position == last_word,
                source.valid.eq(0),
                If(there,
                    advance.eq(1),
                    NextState("SUM")
                )
            ).Elif(there & source.ready,
                advance.eq(1),
                self.payload.ready.eq(~in_header),
                NextValue(position, position + 1)
            )
        )
        fsm.act("SUM",
            NextState("TAIL")
        )
        fsm.act("TAIL",
            source.valid.eq(1),
            Case(tail, {bytes: source.data.eq(value) for bytes, value in filled.items()}),
            If(source.ready,
                self.payload.ready.eq(~in_header),
                NextState("CRC")
            )
        )
        fsm.act("CRC",
            source.valid.eq(1),
            source.last.eq(1),
            Case(tail, {bytes: [source.data.eq(value), source.last_be.eq(marks[bytes])] for bytes, value in rest.items()}),
            If(source.ready,
                sink.ready.eq(1),
                self.sent.eq(1),
                NextState("IDLE")
            )
        )
