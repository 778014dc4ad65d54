#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common     import *
from .message     import *
from .message_crc import SumCRC

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

        self.position  = Signal(max=MESSAGE_WORDS) # Number of the next word of header and payload,
        self.last_word = Signal(max=MESSAGE_WORDS) # and of the last one of both.
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
        counts = Signal() # The CRC takes the word that is held,
        last   = Signal() # which is the last one.
        self.crc = crc = SumCRC()
        self.comb += [
            tail.eq(Cat(self.sink.length[:2], self.sink.length[:2] == 0)),
            crc.be.eq(0b1000),
            If(last,
                Case(tail, {n: crc.be.eq(1 << n - 1) for n in range(1, 5)})
            ),
            crc.data.eq(held),
            crc.ce.eq(counts),
        ]
        self.sync += [
            held.eq(self.word),
            counts.eq(self.advance),
            last.eq(self.position == self.last_word),
        ]
        return tail

    def add_datagram(self, port, tail):
        """Send the words, then the CRC, which begins in the last word of the payload unless that is full."""
        sink, source = self.sink, self.source
        rounded = Signal(12)
        rotated = Signal(32)              # The CRC, its first byte after the payload's last.
        of_word = Signal(4, reset=0b1111) # Bytes of the datagram that are the word's; the others are the CRC's.
        summed  = self.crc.value
        self.comb += [
            rounded.eq(sink.length + 3),
            source.src_port.eq(port),
            source.dst_port.eq(sink.port),
            source.ip_address.eq(sink.address),
            source.length.eq(sink.length + FRAME_BYTES),
            Case(tail, {
                1:         rotated.eq(Cat(summed[24:], summed[:24])),
                2:         rotated.eq(Cat(summed[16:], summed[:16])),
                3:         rotated.eq(Cat(summed[8:],  summed[:8])),
                "default": rotated.eq(summed),
            }),
            [source.data[8*n:8*n + 8].eq(Mux(of_word[n], self.word[8*n:8*n + 8], rotated[8*n:8*n + 8]))
                for n in range(4)],
        ]
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            self.crc.reset.eq(1),
            NextValue(self.position, 0),
            NextValue(self.last_word, rounded[2:] + HEADER_WORDS - 1),
            If(sink.valid,
                NextState("WORDS")
            )
        )
        fsm.act("WORDS",
            source.valid.eq(self.there),
            If(self.position == self.last_word,
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
            Case(tail, {n: of_word.eq(2**n - 1) for n in range(1, 5)}),
            If(source.ready,
                self.payload.ready.eq(~self.in_header),
                NextState("CRC")
            )
        )
        fsm.act("CRC",
            source.valid.eq(1),
            source.last.eq(1),
            of_word.eq(0),
            Case(tail, {n: source.last_be.eq(1 << n - 1) for n in range(1, 5)}),
            If(source.ready,
                sink.ready.eq(1),
                self.sent.eq(1),
                NextState("IDLE")
            )
        )
