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

    Each datagram has two idle clocks, just before the word in which the CRC starts.

    Parameters
    ----------
    port : int
        UDP port that the datagrams come from.
    """
    def __init__(self, port):
        self.sink    = stream.Endpoint(job_layout())           # Messages; `base` is ignored.
        self.payload = stream.Endpoint([("data", 32)])         # Their payloads, whole words each.
        self.source  = stream.Endpoint(datagram_description()) # Datagrams, from UDP port `port`.
        self.sent    = Signal()                                # A datagram has left (pulse).
        self.latency = None                                    # A datagram has more words than its payload.

        # # #

        self.position  = Signal(max=MESSAGE_WORDS) # Number of the next word of header and payload.
        self.word      = Signal(32)                # That word.
        self.in_header = Signal()                  # It is of the header.
        self.there     = Signal()                  # It is valid.
        self.advance   = Signal()                  # It has left, or is the last one: the CRC takes it.

        self.add_words()
        tail = self.add_crc()
        self.add_datagram(port, tail)

    def add_words(self):
        """Select the words of header and payload."""
        sink   = self.sink
        header = [
            Cat(C(MAGIC, 16), C(VERSION, 8), sink.type),
            sink.session,
            sink.sequence,
            sink.frame_id,
            sink.offset,
            sink.length,
        ]
        self.comb += [
            self.in_header.eq(self.position < HEADER_WORDS),
            self.word.eq(self.payload.data),
            Case(self.position, {n: self.word.eq(value) for n, value in enumerate(header)}),
            self.there.eq(self.in_header | self.payload.valid),
        ]

    def add_crc(self):
        """Compute the CRC, a clock after the words.

        Return the number of bytes in the last word of the payload, or of the header if there is no payload.
        """
        tail   = Signal(3)
        held   = Signal(32)
        counts = Signal() # The CRC takes the word that is held.
        self.crc = crc = MessageCRC()
        self.comb += [
            Case(self.sink.length[:2], {
                1:         [tail.eq(1), crc.be.eq(1)],
                2:         [tail.eq(2), crc.be.eq(2)],
                3:         [tail.eq(3), crc.be.eq(4)],
                "default": [tail.eq(4), crc.be.eq(8)],
            }),
            crc.data.eq(held),
            crc.ce.eq(counts),
        ]
        self.sync += [
            held.eq(self.word),
            counts.eq(self.advance),
        ]
        return tail

    def add_datagram(self, port, tail):
        """Send the words, then the CRC, which begins in the last word of the payload unless that is full."""
        sink, source, word = self.sink, self.source, self.word
        rounded   = Signal(12)
        last_word = Signal(max=MESSAGE_WORDS) # Number of the last word of the payload, or of the header.
        summed    = Signal(32)
        self.comb += [
            rounded.eq(sink.length + 3),
            summed.eq(self.crc.value),
            source.src_port.eq(port),
            source.dst_port.eq(sink.port),
            source.ip_address.eq(sink.address),
            source.length.eq(sink.length + FRAME_BYTES),
        ]
        # By `tail`: the last word of the payload filled up with CRC, then the rest of the CRC.
        filled = {1: Cat(word[:8], summed[:24]), 2: Cat(word[:16], summed[:16]), 3: Cat(word[:24], summed[:8]), 4: word}
        rest   = {1: summed[24:], 2: summed[16:], 3: summed[8:], 4: summed}
        marks  = {1: 0b0001, 2: 0b0010, 3: 0b0100, 4: 0b1000}
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            self.crc.reset.eq(1),
            NextValue(self.position, 0),
            NextValue(last_word, rounded[2:] + HEADER_WORDS - 1),
            If(sink.valid,
                NextState("WORDS")
            )
        )
        fsm.act("WORDS",
            source.valid.eq(self.there),
            source.data.eq(word),
            If(self.position == last_word,
                source.valid.eq(0),
                If(self.there,
                    self.advance.eq(1),
                    NextState("SUM")
                )
            ).Elif(self.there & source.ready,
                self.advance.eq(1),
                self.payload.ready.eq(~self.in_header),
                NextValue(self.position, self.position + 1)
            )
        )
        fsm.act("SUM",
            NextState("TAIL")
        )
        fsm.act("TAIL",
            source.valid.eq(1),
            Case(tail, {bytes: source.data.eq(value) for bytes, value in filled.items()}),
            If(source.ready,
                self.payload.ready.eq(~self.in_header),
                NextState("CRC")
            )
        )
        fsm.act("CRC",
            source.valid.eq(1),
            source.last.eq(1),
            Case(tail, {bytes: [
                source.data.eq(value),
                source.last_be.eq(marks[bytes]),
            ] for bytes, value in rest.items()}),
            If(source.ready,
                sink.ready.eq(1),
                self.sent.eq(1),
                NextState("IDLE")
            )
        )
