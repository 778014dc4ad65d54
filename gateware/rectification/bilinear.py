#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common    import *
from .layouts    import *
from .parameters import FRACTION_BITS

# Bilinear -----------------------------------------------------------------------------------------

@ResetInserter()
class Bilinear(LiteXModule):
    """One pixel between 2 x 2 pixels: cv2.remap's INTER_LINEAR with fixed-point maps.

    With the fractions a of the column and b of the row, in 32nds of a pixel:

        upper  = 32*p00 + a*(p01 - p00)
        lower  = 32*p10 + a*(p11 - p10)
        total  = 32*upper + b*(lower - upper)        at most 255*1024
        result = (total + 512) >> 10                 at most 255

    This is the sum of the four weighted pixels, with three products instead of eight.
    """
    def __init__(self):
        self.sink    = stream.Endpoint(neighbours_layout())     # Pipeline.
        self.source  = stream.Endpoint([("pixel", PIXEL_BITS)]) # Pipeline.
        self.latency = 6 # Twice: difference, product, sum.

        # # #

        sink         = self.sink
        upper        = self.add_blend(sink.p00, sink.p01, sink.column_fraction)
        lower        = self.add_blend(sink.p10, sink.p11, sink.column_fraction)
        row_fraction = delayed(self, sink.row_fraction, 3)
        total        = self.add_blend(upper, lower, row_fraction, rounding=2**(2*FRACTION_BITS - 1))
        self.comb += [
            self.source.valid.eq(delayed(self, sink.valid, self.latency)),
            self.source.pixel.eq(total[2*FRACTION_BITS:]),
        ]

    def add_blend(self, first, second, fraction, rounding=0):
        """Return 32 times the number between two unsigned ones, plus `rounding`, three clocks later."""
        bits       = len(first)
        difference = Signal((bits + 1, True))
        product    = Signal((bits + 1 + FRACTION_BITS, True))
        scaled     = Signal(bits + FRACTION_BITS)
        result     = Signal(bits + FRACTION_BITS)
        factor     = delayed(self, fraction, 1)
        self.comb += scaled[FRACTION_BITS:].eq(delayed(self, first, 2))
        self.sync += [
            difference.eq(second - first),
            product.eq(difference*factor),
            result.eq(scaled + product + rounding),
        ]
        return result
