#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common     import *
from .message     import *
from .message_crc import CheckCRC

# Message Buffer -----------------------------------------------------------------------------------

@ResetInserter()
class MessageBuffer(LiteXModule):
    """Take datagrams as they come from the wire, and pass on those that are messages, whole and checked.

    The wire does not wait: the sink is always ready, except in the clock after a datagram, in which the datagram is
    judged. Its words have been written after those of the messages that wait; they are discarded if the datagram is no
    message (length, magic, CRC), or if there was no room for all of it.

    Parameters
    ----------
    words : int
        Room, in words of 32 bits; a power of 2.
    messages : int
        Most messages that wait.
    """
    def __init__(self, words=1024, messages=32):
        check(words >= 2*MESSAGE_WORDS and words & (words - 1) == 0,
            f"words must be a power of 2, at least two messages of {MESSAGE_WORDS} words, not {words}.")
        self.sink      = stream.Endpoint(datagram_description()) # Datagrams.
        self.source    = stream.Endpoint(message_description())  # Messages.
        self.received  = Signal()                                # A datagram has ended (pulse).
        self.malformed = Signal()                                # It was no message (pulse).
        self.overrun   = Signal()                                # There was no room for it (pulse).
        self.latency   = None                                    # A message waits for its end, and for those before it.

        # # #

        self.moves_in = Signal() # A word is taken.
        self.judging  = Signal() # The clock after a datagram's last word.
        self.message  = Signal() # In that clock: the datagram was a message.
        self.fifo     = stream.SyncFIFO([("bytes", 11)] + peer_layout(), messages, buffered=True) # Messages that wait.

        # All that follows looks at the wire's words after a register.
        self.buffer   = stream.Buffer(datagram_description())
        self.comb += [
            self.sink.connect(self.buffer.sink),
            self.buffer.source.ready.eq(~self.judging),
            self.moves_in.eq(self.buffer.source.valid & self.buffer.source.ready),
        ]
        self.sync += self.judging.eq(self.moves_in & self.buffer.source.last)

        self.add_check()
        read, taken = self.add_words(words)
        self.add_output(read, taken)

    def add_check(self):
        """Check a datagram while it comes: length, magic, CRC; keep its size and its sender."""
        sink      = self.buffer.source
        bits      = bits_for(MESSAGE_BYTES - FRAME_BYTES)
        count     = Signal(12)      # Words of the datagram before this one; stays at its largest value.
        tail      = Signal(3)       # Bytes of the last word.
        bytes     = Signal(14)      # Bytes up to this word,
        expected  = Signal(12)      # and those that a message has, as its header says,
        fits      = Signal()        # if its payload is no longer than a chunk.
        sound     = Signal(reset=1) # Nothing wrong so far.
        magic     = Signal()        # The first word begins with the magic number.
        sized     = Signal()        # It has the length of a message.
        size      = Signal(11)      # Of a message, in bytes,
        address   = Signal(32)      # and who sent it.
        port      = Signal(16)
        self.crc = crc = CheckCRC()
        self.comb += [
            crc.data.eq(sink.data),
            Case(sink.last_be, {
                1:         [tail.eq(1), crc.be.eq(1)],
                2:         [tail.eq(2), crc.be.eq(2)],
                4:         [tail.eq(3), crc.be.eq(4)],
                "default": [tail.eq(4), crc.be.eq(8)],
            }),
            crc.ce.eq(self.moves_in),
            crc.reset.eq(self.judging),
            bytes.eq(Cat(C(0, 2), count) + tail),
            magic.eq((count != 0) | (sink.data[:16] == MAGIC)),
            self.message.eq(sound & sized & ~crc.error),
            self.fifo.sink.bytes.eq(size),
            self.fifo.sink.address.eq(address),
            self.fifo.sink.port.eq(port),
        ]
        self.sync += [
            If(self.moves_in,
                sound.eq(sound & magic & (sink.error == 0)),
                If(count == HEADER_WORDS - 1,
                    expected.eq(sink.data[:bits] + FRAME_BYTES),
                    # The longest payload is a power of 2.
                    fits.eq((sink.data[bits:] == 0) & (~sink.data[bits - 1] | (sink.data[:bits - 1] == 0)))
                ),
                sized.eq((count >= HEADER_WORDS) & (bytes == expected) & fits),
                size.eq(bytes),
                address.eq(sink.ip_address),
                port.eq(sink.src_port),
                If(count != 2**len(count) - 1,
                    count.eq(count + 1)
                )
            ),
            If(self.judging,
                count.eq(0),
                sound.eq(1)
            ),
        ]

    def add_words(self, words):
        """Write words at once, and keep them if their datagram is a message.

        Return the port to read them by, and the place of the next one to read.
        """
        memory = Memory(32, words, name="message_buffer")
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        read   = memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read

        begin    = Signal(max=2*words) # Where this datagram begins; one bit more tells full from empty.
        position = Signal(max=2*words) # Where its next word goes.
        taken    = Signal(max=2*words) # First word that is not free.
        level    = Signal(max=2*words) # Words that are not free.
        room     = Signal()            # There is room for this word.
        lost     = Signal()            # A word of this datagram found no room.
        fifo     = self.fifo
        self.comb += [
            level.eq(position - taken),
            room.eq((level != words) & ~lost & fifo.sink.ready),
            write.adr.eq(position[:-1]),
            write.dat_w.eq(self.buffer.source.data),
            write.we.eq(self.moves_in & room),
            fifo.sink.valid.eq(self.judging & self.message & ~lost),
            self.received.eq(self.judging),
            self.malformed.eq(self.judging & ~self.message),
            self.overrun.eq(self.judging & self.message & lost),
        ]
        self.sync += [
            If(self.moves_in,
                lost.eq(~room),
                position.eq(position + room)
            ),
            If(self.judging,
                lost.eq(0),
                If(self.message & ~lost,
                    begin.eq(position)
                ).Else(
                    position.eq(begin)
                )
            ),
        ]
        return read, taken

    def add_output(self, read, taken):
        """Give out the messages that wait, and count their words in `taken`."""
        fifo      = self.fifo
        index     = Signal(max=MESSAGE_WORDS) # Number of the next word in its message,
        last_word = Signal(max=MESSAGE_WORDS) # and of the last one,
        last_byte = Signal(max=MESSAGE_BYTES) # which this byte ends.
        moves     = Signal()                  # A word is taken.
        following = Signal(len(taken))        # Place of the word that is next in the clock after.
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
