#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from liteeth.mac.crc import LiteEthMACCRC32, LiteEthMACCRCEngine

# Message CRC --------------------------------------------------------------------------------------

@ResetInserter()
@CEInserter()
class MessageCRC(LiteXModule):
    """CRC-32 of words of 32 bits, of which the last one may count in part.

    It replaces `LiteEthMACCRC32`, which has an engine for each number of bytes. Here the engines of the second half of
    a word follow those of the first half: two thirds of the size, and with a register after them fast enough for the
    system's clock.
    """
    def __init__(self):
        self.data    = Signal(32)              # Word, the first byte in the low bits.
        self.be      = Signal(4, reset=0b1000) # Mark of the last byte that counts.
        self.value   = Signal(32)              # CRC of all words up to this one.
        self.error   = Signal()                # These words do not end in their own CRC.
        self.latency = 1

        # # #

        state = Signal(32, reset=LiteEthMACCRC32.init)
        ended = Signal(32)
        crc   = state
        for n in range(4):
            half, bits = n//2, 8*(n%2 + 1)
            engine     = LiteEthMACCRCEngine(bits, LiteEthMACCRC32.width, LiteEthMACCRC32.polynom)
            self.add_module(name=f"engine{n}", module=engine)
            self.comb += [
                engine.data.eq(self.data[16*half:16*half + bits]),
                engine.crc_prev.eq(crc),
            ]
            self.sync += If(self.be[n], ended.eq(engine.crc_next))
            if bits == 16:
                crc = engine.crc_next
        self.sync += state.eq(crc)
        self.comb += [
            self.value.eq(ended[::-1] ^ LiteEthMACCRC32.init),
            self.error.eq(ended != LiteEthMACCRC32.check),
        ]
