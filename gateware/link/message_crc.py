#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""CRC-32 of words of 32 bits, of which the last one may count in part.

LiteEth's engine of 32 bits has an engine for each number of bytes. Here there is one of a whole word, which is linear:
with `CheckCRC` a word that counts in part ends in zeros, and with `SumCRC` it begins with them.
"""

from itertools import combinations

from migen import *

from litex.gen import *

from liteeth.mac.crc import LiteEthMACCRC32

WIDTH = LiteEthMACCRC32.width

# Engine -------------------------------------------------------------------------------------------

def next_state(state, data, bits):
    """Return the CRC's register as an int, after so many bits of data, the lowest bit first."""
    for n in range(bits):
        carry = state >> (WIDTH - 1) ^ data >> n & 1
        state = state << 1 & (2**WIDTH - 1) ^ carry*LiteEthMACCRC32.polynom
    return state

def word_terms():
    """Return for each bit of the register after a word the bits of that word which it is the sum of, from a register
    of 0. With another register, its bits are added to the word first, the highest bit to bit 0."""
    ends = [next_state(0, 1 << n, WIDTH) for n in range(WIDTH)]
    return [{n for n, end in enumerate(ends) if end >> bit & 1} for bit in range(WIDTH)]

def add_sums(module, bits, sums):
    """Return a Signal for each set of indices in `sums`: the exclusive or of these bits.

    A pair that is in several sums is added once, the most frequent pair first.
    """
    bits = list(bits)
    sums = [set(one) for one in sums]
    while True:
        pairs = {}
        for one in sums:
            for pair in combinations(sorted(one), 2):
                pairs[pair] = pairs.get(pair, 0) + 1
        pair = max(pairs, key=lambda pair: (pairs[pair], [-n for n in pair]), default=None)
        if pair is None or pairs[pair] < 2:
            break
        shared = Signal()
        module.comb += shared.eq(bits[pair[0]] ^ bits[pair[1]])
        bits.append(shared)
        for one in sums:
            if one >= set(pair):
                one.symmetric_difference_update({*pair, len(bits) - 1})
    totals = [Signal() for _ in sums]
    for total, one in zip(totals, sums):
        module.comb += total.eq(Reduce("XOR", [bits[n] for n in sorted(one)]))
    return totals

# Check CRC ----------------------------------------------------------------------------------------

@ResetInserter()
@CEInserter()
class CheckCRC(LiteXModule):
    """Tell whether words end in their own CRC.

    Zeros follow the last byte that counts, and the register ends in another value for each number of them.
    """
    def __init__(self):
        self.data    = Signal(32)              # Word, the first byte in the low bits.
        self.be      = Signal(4, reset=0b1000) # Mark of the last byte that counts; the last one but in the last word.
        self.error   = Signal()                # The words up to this one do not end in their own CRC.
        self.latency = 1

        # # #

        state = Signal(WIDTH, reset=LiteEthMACCRC32.init)
        bytes = Signal(2)     # Of the last word, less one.
        right = Signal(WIDTH) # Register after words that end in their CRC.
        word  = Signal(32)
        added = Signal(32)
        self.comb += [
            added.eq(word ^ state[::-1]),
            word[:8].eq(self.data[:8]),
            If(~self.be[0],
                word[8:16].eq(self.data[8:16])
            ),
            If(~self.be[0] & ~self.be[1],
                word[16:24].eq(self.data[16:24])
            ),
            If(self.be[3],
                word[24:].eq(self.data[24:])
            ),
            Case(bytes, {n: right.eq(next_state(LiteEthMACCRC32.check, 0, 8*(3 - n))) for n in range(4)}),
            self.error.eq(state != right),
        ]
        self.sync += [
            state.eq(Cat(*add_sums(self, added, word_terms()))),
            bytes.eq(Cat(self.be[1] | self.be[3], self.be[2] | self.be[3])),
        ]

# Sum CRC ------------------------------------------------------------------------------------------

@ResetInserter()
@CEInserter()
class SumCRC(LiteXModule):
    """Compute the CRC of words.

    The bytes of the last word that count are added to the register's high bytes, and are then the last bytes of a word
    that begins with zeros. The register's other bytes are shifted, and added to the result.
    """
    def __init__(self):
        self.data    = Signal(32)              # Word, the first byte in the low bits.
        self.be      = Signal(4, reset=0b1000) # Mark of the last byte that counts; the last one but in the last word.
        self.value   = Signal(32)              # CRC of all words up to this one.
        self.latency = 1

        # # #

        state   = Signal(WIDTH, reset=LiteEthMACCRC32.init)
        added   = Signal(32)
        word    = Signal(32)
        shifted = Signal(WIDTH)
        self.comb += [
            added.eq(self.data ^ state[::-1]),
            self.value.eq(~state[::-1]),
        ]
        for n, bits in enumerate([8, 16, 24]):
            self.comb += If(self.be[n],
                word[32 - bits:].eq(added[:bits]),
                shifted[bits:].eq(state[:32 - bits])
            )
        self.comb += If(self.be[3],
            word.eq(added)
        )
        self.sync += state.eq(Cat(*add_sums(self, word, word_terms())) ^ shifted)
