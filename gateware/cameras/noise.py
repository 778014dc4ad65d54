#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common import PIXEL_BITS

NOISE_BITS = 16                # Of the state. Its sequence repeats after 2**16 - 1 bits, so pixels of a row do not.
TAPS       = (15, 13, 12, 10)  # Of x**16 + x**14 + x**13 + x**11 + 1, which is primitive.
ROW_BITS   = 12                # Of the row's number, which seeds the noise of the row.
ROW_SEED   = 0xa               # Above them, so that the state is never 0.

# Noise --------------------------------------------------------------------------------------------

@ResetInserter()
class Noise(LiteXModule):
    """A row of noise: a shift register with feedback, that moves by the bits of a pixel at once.

    `pixel` is its low bits. The noise of a row depends on its number only.
    """
    def __init__(self):
        self.row   = Signal(ROW_BITS)   # Number of the row.
        self.seed  = Signal()           # Begin with the first pixel of that row (pulse).
        self.step  = Signal()           # Go on to the next pixel (pulse).
        self.pixel = Signal(PIXEL_BITS) # Of the row, from the clock after `seed` on.

        # # #

        state = Signal(NOISE_BITS)
        bits  = [state[bit] for bit in range(NOISE_BITS)]
        for _ in range(PIXEL_BITS):
            bits = [bits[TAPS[0]] ^ bits[TAPS[1]] ^ bits[TAPS[2]] ^ bits[TAPS[3]], *bits[:-1]]
        self.comb += self.pixel.eq(state[:PIXEL_BITS])
        self.sync += If(self.seed,
            state.eq(Cat(self.row, Constant(ROW_SEED, NOISE_BITS - ROW_BITS)))
        ).Elif(self.step,
            state.eq(Cat(*bits))
        )
