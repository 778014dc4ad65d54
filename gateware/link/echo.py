#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .headers import *

# Echo ---------------------------------------------------------------------------------------------

@ResetInserter()
class Echo(LiteXModule):
    """Keep requests for an echo, and offer the replies to them: ICMP's header and data, up to 128 bytes.

    Two requests may wait if both find room. Those that do not, and those that are too long, are discarded.
    """
    def __init__(self):
        # As HeaderParser has them.
        self.word    = Signal(32) # Word of a request, big-endian,
        self.write   = Signal()   # if there is one.
        self.begin   = Signal()   # Words of another frame follow.
        self.done    = Signal()   # The request was correct (pulse).
        self.bytes   = Signal(12) # Its bytes.
        self.sender  = Signal(32) # Who sent it.
        self.source  = stream.Endpoint(sent_layout()) # The reply, big-endian.
        self.address = Signal(32) # Who gets it.
        self.length  = Signal(8)  # Its bytes.

        # # #

        self.memory = memory = Memory(32, ECHO_WORDS)
        self.specials += memory
        self.waits  = Signal()                 # A reply is offered,
        self.next   = Signal()                 # and another one waits: its receiver, its length, its last word.
        self.fields = [Signal(32, name="next_address"), Signal(8, name="next_length"),
            Signal(max=ECHO_WORDS, name="next_final")]
        self.final  = Signal(max=ECHO_WORDS)   # Place of the last word of the reply that is offered.
        self.read   = Signal(max=2*ECHO_WORDS) # Place of its next one; one bit more tells full from empty.

        self.add_requests()
        self.add_replies()

    def add_requests(self):
        """Write a request after those that wait, and keep it if it is correct."""
        port = self.memory.get_port(write_capable=True)
        self.specials += port
        start    = Signal(max=2*ECHO_WORDS) # Where it begins.
        place    = Signal(max=2*ECHO_WORDS) # Where its next word goes,
        last     = Signal(max=ECHO_WORDS)   # and where its last one went.
        first    = Signal()                 # Its next word is the first one.
        active   = Signal()                 # It can be kept,
        over     = Signal()                 # but found no room.
        full     = Signal()
        finished = Signal()
        wraps    = Signal()
        summed   = Signal(17)               # Checksum of the reply: its type is less by 8 in the first byte.
        self.comb += [
            full.eq((place[:-1] == self.read[:-1]) & (place[-1] != self.read[-1])),
            wraps.eq(self.word[11:16] == 0x1f),
            summed.eq(Cat(wraps, self.word[:16]) + Cat(wraps, C(0x0800, 16))),
            port.adr.eq(place[:-1]),
            port.dat_w.eq(self.word),
            If(first,
                port.dat_w.eq(Cat(summed[1:], C(0, 16)))
            ),
            port.we.eq(self.write & active & ~full),
        ]
        self.sync += [
            finished.eq(self.done),
            If(self.begin,
                active.eq(~self.next),
                over.eq(0),
                first.eq(1),
                place.eq(start)
            ),
            If(self.write & active,
                first.eq(0),
                If(full,
                    over.eq(1)
                ).Else(
                    place.eq(place + 1),
                    last.eq(place)
                )
            ),
            If(self.next & ~self.waits,
                self.next.eq(0)
            ),
            If(finished & active & ~over,
                self.next.eq(1),
                active.eq(0),
                start.eq(place),
                *[field.eq(value) for field, value in zip(self.fields, (self.sender, self.bytes, last), strict=True)]
            ),
        ]

    def add_replies(self):
        """Offer the oldest one that waits."""
        port   = self.memory.get_port(async_read=True)
        source = self.source
        end    = Signal(2)
        self.specials += port
        self.comb += [
            port.adr.eq(self.read[:-1]),
            end.eq(self.length[:2] - 1),
            source.valid.eq(self.waits),
            source.data.eq(port.dat_r),
            source.last.eq(self.read[:-1] == self.final),
            source.tail.eq(end),
        ]
        self.sync += [
            If(source.valid & source.ready,
                self.read.eq(self.read + 1),
                If(source.last,
                    self.waits.eq(0)
                )
            ),
            If(self.next & ~self.waits,
                self.waits.eq(1),
                *[field.eq(value) for field, value in zip((self.address, self.length, self.final), self.fields,
                    strict=True)]
            ),
        ]
