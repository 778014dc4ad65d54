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

# Message Buffer -----------------------------------------------------------------------------------

@ResetInserter()
class MessageBuffer(LiteXModule):
    """Take datagrams as they come from the wire, give on those that are messages, whole and checked.

    The wire does not wait, so the sink is always ready but for the clock behind a datagram, which is judged then: it has been
    written behind the messages that wait, and if it is not a message (length, magic, CRC), or if there was no room, its words are
    forgotten.

    Parameters
    ----------
    words : int
        Room, in words of 32 bits; a power of 2.
    messages : int
        Messages that can wait at most.
    """
    def __init__(self, words=1024, messages=32):
        check(words >= 2*MESSAGE_WORDS and words & (words - 1) == 0,
            f"words must be a power of 2, at least two messages of {MESSAGE_WORDS} words, not {words}.")
        self.sink      = stream.Endpoint(datagram_description()) # Datagrams.
        self.source    = stream.Endpoint(message_description())  # Messages.
        self.received  = Signal()                                # A datagram has ended (pulse).
        self.malformed = Signal()                                # It was no message (pulse).
        self.overrun   = Signal()                                # There was no room for it (pulse).

        # # #

        # Register in front: everything below looks at whole words.
        # ---------------------------------------------------------
        self.buffer = buffer = stream.Buffer(datagram_description())
        sink        = buffer.source
        moves_in    = Signal()
        judging     = Signal()
        self.comb += [
            self.sink.connect(buffer.sink),
            sink.ready.eq(~judging),
            moves_in.eq(sink.valid & sink.ready),
        ]
        self.sync += judging.eq(moves_in & sink.last)

        # Check.
        # ------
        count     = Signal(12) # Words of the datagram before this one; stays at the most.
        announced = Signal(32)
        payload   = Signal(32) # As announced, also with the word that announces it.
        tail      = Signal(3)  # Bytes of the last word.
        bytes     = Signal(14)
        expected  = Signal(33)
        sound     = Signal(reset=1) # Nothing wrong so far.
        magic     = Signal()
        sized     = Signal()        # It has the length of a message.
        message   = Signal()
        size      = Signal(11)      # Of a message, in bytes,
        address   = Signal(32)      # and who sent it.
        port      = Signal(16)
        self.crc = crc = MessageCRC()
        self.comb += [
            crc.data.eq(sink.data),
            Case(sink.last_be, {
                1:         [tail.eq(1), crc.be.eq(1)],
                2:         [tail.eq(2), crc.be.eq(2)],
                4:         [tail.eq(3), crc.be.eq(4)],
                "default": [tail.eq(4), crc.be.eq(8)],
            }),
            crc.ce.eq(moves_in),
            crc.reset.eq(judging),
            bytes.eq(Cat(C(0, 2), count) + tail),
            payload.eq(Mux(count == HEADER_WORDS - 1, sink.data, announced)),
            expected.eq(payload + FRAME_BYTES),
            magic.eq((count != 0) | (sink.data[:16] == MAGIC)),
            message.eq(sound & sized & ~crc.error),
        ]
        self.sync += [
            If(moves_in,
                sound.eq(sound & magic & (sink.error == 0)),
                announced.eq(payload),
                sized.eq((count >= HEADER_WORDS) & (bytes == expected) & (expected <= MESSAGE_BYTES)),
                size.eq(bytes),
                address.eq(sink.ip_address),
                port.eq(sink.src_port),
                If(count != 2**len(count) - 1,
                    count.eq(count + 1)
                )
            ),
            If(judging,
                count.eq(0),
                sound.eq(1)
            ),
        ]

        # Words: written at once, kept when the message is.
        # -------------------------------------------------
        memory  = Memory(32, words, name="message_buffer")
        write   = memory.get_port(write_capable=True, mode=READ_FIRST)
        read    = memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read

        begin    = Signal(max=2*words) # Where this datagram begins; one bit more tells full from empty.
        position = Signal(max=2*words) # Where its next word goes.
        taken    = Signal(max=2*words) # First word that is not free.
        level    = Signal(max=2*words)
        room     = Signal()
        lost     = Signal() # A word of this datagram found no room.
        self.fifo = fifo = stream.SyncFIFO([("bytes", 11)] + peer_layout(), messages, buffered=True)
        self.comb += [
            level.eq(position - taken),
            room.eq((level != words) & ~lost & fifo.sink.ready),
            write.adr.eq(position[:-1]),
            write.dat_w.eq(sink.data),
            write.we.eq(moves_in & room),
            fifo.sink.valid.eq(judging & message & ~lost),
            fifo.sink.bytes.eq(size),
            fifo.sink.address.eq(address),
            fifo.sink.port.eq(port),
            self.received.eq(judging),
            self.malformed.eq(judging & ~message),
            self.overrun.eq(judging & message & lost),
        ]
        self.sync += [
            If(moves_in,
                lost.eq(~room),
                position.eq(position + room)
            ),
            If(judging,
                lost.eq(0),
                If(message & ~lost,
                    begin.eq(position)
                ).Else(
                    position.eq(begin)
                )
            ),
        ]

        # Out: a message is there as a whole before its first word is.
        # ------------------------------------------------------------
        index     = Signal(max=MESSAGE_WORDS)
        last_byte = Signal(max=MESSAGE_BYTES)
        last_word = Signal(max=MESSAGE_WORDS)
        moves     = Signal()
        following = Signal(max=2*words)
        self.comb += [
            last_byte.eq(fifo.source.bytes - 1),
            last_word.eq(last_byte[2:]),
            self.source.valid.eq(fifo.source.valid),
            self.source.data.eq(read.dat_r),
            self.source.last.eq(index == last_word),
            self.source.bytes.eq(fifo.source.bytes),
            self.source.address.eq(fifo.source.address),
            self.source.port.eq(fifo.source.port),
            moves.eq(self.source.valid & self.source.ready),
            fifo.source.ready.eq(moves & self.source.last),
            following.eq(taken + moves),
            read.adr.eq(following[:-1]),
        ]
        self.sync += [
            taken.eq(following),
            If(moves,
                index.eq(index + 1),
                If(self.source.last,
                    index.eq(0)
                )
            ),
        ]
