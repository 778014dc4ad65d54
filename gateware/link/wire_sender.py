#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common  import eth_fcs_length, eth_interpacket_gap, eth_min_frame_length, eth_phy_description
from liteeth.mac.crc import LiteEthMACCRC32, LiteEthMACCRCEngine

from .headers import sent_layout

LEAST_BYTES = eth_min_frame_length - eth_fcs_length # Of a frame without its CRC.

# Wire Sender --------------------------------------------------------------------------------------

@ResetInserter()
class WireSender(LiteXModule):
    """Send words of frames as bytes: gap, preamble, frame without the two bytes of padding in front, filling, CRC.

    The gap comes before the preamble: meanwhile words gather in the crossing before this core, which may not run dry
    within a frame.

    Parameters
    ----------
    with_preamble_crc : bool
        Send preamble and CRC; without, as in simulation, frames are sent as they are.
    """
    def __init__(self, with_preamble_crc=True):
        self.sink    = stream.Endpoint(sent_layout())          # Words.
        self.source  = stream.Endpoint(eth_phy_description(8)) # Bytes.
        self.latency = None                                    # The gap is before a frame.

        # # #

        self.byte    = Signal(8) # Byte of a frame, or of its preamble,
        self.there   = Signal()  # if there is one.
        self.counts  = Signal()  # It counts for the CRC.
        self.of_crc  = Signal()  # It is one of the CRC instead,
        self.number  = Signal(2) # with this number.
        self.last    = Signal()  # It is the last of its frame.
        self.advance = Signal()  # The PHY takes a byte, or has none.

        self.add_bytes(with_preamble_crc)
        self.add_output(with_preamble_crc)

    def add_bytes(self, with_preamble_crc):
        """Choose the bytes, but for those of the CRC."""
        sink, source = self.sink, self.source
        count  = Signal(max=LEAST_BYTES) # Bytes of this state so far; of a frame's at most as many as it has at least.
        place  = Signal(2, reset=2)      # Of the byte in its word.
        ends   = Signal()                # The byte is the last of the words,
        enough = Signal()                # and there is no need for filling.
        self.comb += [
            self.advance.eq(source.ready | ~source.valid),
            ends.eq(sink.last & (place == sink.tail)),
            enough.eq(count == LEAST_BYTES - 1),
        ]
        follow = "CRC" if with_preamble_crc else "GAP"
        last   = [] if with_preamble_crc else [NextValue(self.last, 1)]
        def leave(state, condition, *statements):
            return If(condition, NextValue(count, 0), NextState(state), *statements)
        self.fsm = fsm = CEInserter()(FSM(reset_state="GAP"))
        self.comb += fsm.ce.eq(self.advance)
        fsm.act("GAP",
            NextValue(self.there,  0),
            NextValue(self.counts, 0),
            NextValue(self.of_crc, 0),
            NextValue(self.last,   0),
            If(sink.valid,
                NextValue(count, count + 1),
                leave("PREAMBLE" if with_preamble_crc else "FRAME", count == eth_interpacket_gap - 1)
            )
        )
        fsm.act("PREAMBLE",
            NextValue(self.there, 1),
            NextValue(self.byte, 0x55),
            NextValue(count, count + 1),
            leave("FRAME", count == 7, NextValue(self.byte, 0xd5))
        )
        fsm.act("FRAME",
            NextValue(self.there, sink.valid),
            NextValue(self.counts, 1),
            Case(place, {n: NextValue(self.byte, sink.data[8*n:8*n + 8]) for n in range(4)}),
            sink.ready.eq(self.advance & (ends | (place == 3))),
            If(sink.valid,
                NextValue(place, place + 1),
                If(~enough,
                    NextValue(count, count + 1)
                ),
                If(ends,
                    NextValue(place, 2),
                    If(enough,
                        NextValue(count, 0),
                        NextState(follow),
                        *last
                    ).Else(
                        NextState("FILL")
                    )
                )
            )
        )
        fsm.act("FILL",
            NextValue(self.byte, 0),
            NextValue(count, count + 1),
            leave(follow, enough, *last)
        )
        if with_preamble_crc:
            fsm.act("CRC",
                NextValue(self.counts, 0),
                NextValue(self.of_crc, 1),
                NextValue(self.number, count[:2]),
                NextValue(count, count + 1),
                leave("GAP", count == 3, NextValue(self.last, 1))
            )

    def add_output(self, with_preamble_crc):
        """Give the bytes out, with those of the CRC."""
        source = self.source
        byte   = Signal(8)
        self.comb += byte.eq(self.byte)
        self.sync += If(self.advance,
            source.valid.eq(self.there),
            source.data.eq(byte),
            source.last.eq(self.last),
            source.last_be.eq(self.last)
        )
        if with_preamble_crc:
            crc = Signal(32, reset=LiteEthMACCRC32.init)
            self.engine = engine = LiteEthMACCRCEngine(8, LiteEthMACCRC32.width, LiteEthMACCRC32.polynom)
            self.comb += [
                engine.data.eq(self.byte),
                engine.crc_prev.eq(crc),
                If(self.of_crc,
                    Case(self.number, {n: byte.eq(~crc[::-1][8*n:8*n + 8]) for n in range(4)})
                ),
            ]
            self.sync += If(self.advance & self.there & ~self.of_crc,
                If(self.counts,
                    crc.eq(engine.crc_next)
                ).Else(
                    crc.eq(LiteEthMACCRC32.init)
                )
            )
