#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *
from ..costs   import *

# Absolute Difference ------------------------------------------------------------------------------

@ResetInserter()
class AbsoluteDifference(LiteXModule):
    """|left(x) - right(x - d)| for all disparities d at once, of the row that enters and the row that leaves.

    The right pixels wait in shift registers, one step per column. The lane behind the last disparity is the texture,
    |left(x) - cap|. Only steps that have a cost come out.

    A lane has a bit more than a pixel: below the absolute difference, less one if the difference is negative, and above
    that one. Who sums them adds it as the carry of an adder that is there anyway; here it would take one of its own.
    """
    def __init__(self, parameters):
        bits, lanes = parameters.filtered_bits, parameters.lanes
        self.sink   = stream.Endpoint(old_pair_layout(bits) + position_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint([
            ("enter", lanes*(bits + 1)),
            ("leave", lanes*(bits + 1)),
        ] + position_layout(parameters))                                                   # Pipeline.

        self.cap     = Signal(max=MAX_PREFILTER_CAP + 1) # Value of a filtered pixel without texture.
        self.latency = 2

        # # #

        pass_position(self, self.sink, self.source, self.latency, valid=self.sink.valid & self.sink.cost)
        for new_left, new_right, target in [
            (self.sink.left,     self.sink.right,     self.source.enter),
            (self.sink.left_old, self.sink.right_old, self.source.leave),
        ]:
            left = Signal(bits, reset_less=True)
            self.sync += If(self.sink.valid & self.sink.move_left, left.eq(new_left))
            rights = []
            for _ in range(parameters.disparities):
                right = Signal(bits, reset_less=True)
                self.sync += If(self.sink.valid & self.sink.move_right, right.eq(rights[-1] if rights else new_right))
                rights.append(right)
            if lanes > parameters.disparities:
                rights.append(self.cap)
            for lane, right in zip(lanes_of(target, lanes), rights):
                # Difference with its sign, then its magnitude: its bits, inverted if it is negative, lack that one.
                difference = Signal(bits + 1, reset_less=True)
                negative   = difference[-1]
                self.sync += difference.eq(left - right)
                self.comb += lane.eq(Cat(difference[:bits] ^ Replicate(negative, bits), negative))
