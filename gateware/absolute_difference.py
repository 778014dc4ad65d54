#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common import *

# Absolute Difference ------------------------------------------------------------------------------

@ResetInserter()
class AbsoluteDifference(LiteXModule):
    """|left(x) - right(x - d)| for all disparities d at once, of the row that enters and the row that leaves.

    The right pixels wait in shift registers, one step per pixel. To the left of column d lane d compares with pixels
    of the row before; no complete block ever contains such a column.
    """
    def __init__(self, max_width=640, disparities=64):
        self.sink = stream.Endpoint(pixel_pair_layout() + [
            ("left_old",  PIXEL_BITS),
            ("right_old", PIXEL_BITS),
        ] + position_layout(max_width))                    # Pipeline.
        self.source = stream.Endpoint([
            ("enter", disparities*PIXEL_BITS),
            ("leave", disparities*PIXEL_BITS),
        ] + position_layout(max_width))                    # Pipeline.
        self.latency = 2

        # # #

        pass_position(self, self.sink, self.source, self.latency)
        for left, right, target in [
            (self.sink.left,     self.sink.right,     self.source.enter),
            (self.sink.left_old, self.sink.right_old, self.source.leave),
        ]:
            for lane in lanes_of(target, disparities):
                # Difference with its sign, then its magnitude: x if positive, ~x + 1 if negative.
                difference = Signal(PIXEL_BITS + 1)
                negative   = difference[-1]
                magnitude  = Signal(PIXEL_BITS)
                self.sync += difference.eq(left - right)
                self.sync += magnitude.eq((difference[:PIXEL_BITS] ^ Replicate(negative, PIXEL_BITS)) + negative)
                self.comb += lane.eq(magnitude)

                # The next lane sees the right pixel one column later.
                delayed = Signal(PIXEL_BITS)
                self.sync += If(self.sink.valid, delayed.eq(right))
                right = delayed
