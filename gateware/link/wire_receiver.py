#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common  import eth_phy_description
from liteeth.mac.crc import LiteEthMACCRC32, LiteEthMACCRCEngine

from .headers import received_layout

# Wire Receiver ------------------------------------------------------------------------------------

class WireReceiver(LiteXModule):
    """Turn the bytes of a PHY into words of frames, with two bytes of padding in front, without preamble and CRC.

    A frame of a wrong CRC is marked as an error in its last word. The wire does not wait: if a word is not taken at
    once, it is lost, and its frame has an error. It is reset with its clock domain alone; until the next preamble the
    rest of a frame is discarded.

    Parameters
    ----------
    with_preamble_crc : bool
        Frames have a preamble and a CRC; without, as in simulation, they are as they are.
    """
    def __init__(self, with_preamble_crc=True):
        self.sink    = stream.Endpoint(eth_phy_description(8)) # Bytes; ready is always 1.
        self.source  = stream.Endpoint(received_layout())      # Words.
        self.latency = None                                    # The last word but one waits for the last one.

        # # #

        self.data   = Signal(8) # Byte,
        self.last   = Signal()  # the last of its frame,
        self.valid  = Signal()  # if there is one,
        self.taken  = Signal()  # and it belongs to a frame.
        self.word   = [Signal(8, name=f"lane{n}", reset_less=True) for n in range(4)] # The word so far.
        self.place  = Signal(2, reset=2) # Where the next byte goes.
        self.full   = Signal()           # The word is whole, or ends its frame:
        self.ended  = Signal()           # that is so,
        self.tail   = Signal(2)          # and this was its last byte.
        self.lost   = Signal()           # A word of the frame was not taken.
        source      = self.source
        self.comb += self.sink.ready.eq(1)
        self.sync += [
            self.valid.eq(self.sink.valid),
            self.data.eq(self.sink.data),
            self.last.eq(self.sink.last),
            self.full.eq(self.taken & (self.last | (self.place == 3))),
            self.ended.eq(self.last),
            self.tail.eq(self.place),
            If(self.taken,
                Case(self.place, {n: lane.eq(self.data) for n, lane in enumerate(self.word)}),
                self.place.eq(self.place + 1),
                If(self.last,
                    self.place.eq(2)
                )
            ),
            If(source.valid & ~source.ready,
                self.lost.eq(1)
            ).Elif(source.valid & source.last,
                self.lost.eq(0)
            ),
        ]
        if with_preamble_crc:
            self.add_preamble()
            self.add_crc()
        else:
            self.comb += [
                self.taken.eq(self.valid),
                source.valid.eq(self.full),
                source.data.eq(Cat(*self.word)),
                source.error.eq(self.lost),
            ]
        self.comb += [
            source.last.eq(self.ended),
            source.tail.eq(self.tail),
        ]

    def add_preamble(self):
        """Begin a frame after the byte that ends a preamble."""
        self.inside = Signal()
        self.comb += self.taken.eq(self.valid & self.inside)
        self.sync += If(self.valid,
            If(self.last,
                self.inside.eq(0)
            ).Elif(self.data == 0xd5,
                self.inside.eq(1)
            )
        )

    def add_crc(self):
        """Check the CRC, and leave it out: a word is given out when the one after it has come."""
        crc    = Signal(32, reset=LiteEthMACCRC32.init)
        held   = Signal(32, reset_less=True)
        holds  = Signal() # There is a word in it.
        wrong  = Signal()
        source = self.source
        self.engine = engine = LiteEthMACCRCEngine(8, LiteEthMACCRC32.width, LiteEthMACCRC32.polynom)
        self.comb += [
            engine.data.eq(self.data),
            engine.crc_prev.eq(crc),
            wrong.eq(crc != LiteEthMACCRC32.check),
            source.valid.eq(self.full & holds),
            source.data.eq(held),
            source.error.eq(wrong | self.lost),
        ]
        self.sync += [
            If(~self.inside,
                crc.eq(LiteEthMACCRC32.init)
            ).Elif(self.taken,
                crc.eq(engine.crc_next)
            ),
            If(self.full,
                held.eq(Cat(*self.word)),
                holds.eq(~self.ended)
            ),
        ]
