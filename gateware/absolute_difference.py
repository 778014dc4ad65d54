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

    The right pixels wait in shift registers, one step per column. The lane behind the last disparity is the texture,
    |left(x) - cap|. Only steps that have a cost come out.
    """
    def __init__(self, parameters):
        bits, lanes = parameters.filtered_bits, parameters.lanes
        self.sink   = stream.Endpoint(old_pair_layout(bits) + position_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint([
            ("enter", lanes*bits),
            ("leave", lanes*bits),
        ] + position_layout(parameters))                                                   # Pipeline.

        self.cap     = Signal(max=MAX_PREFILTER_CAP + 1) # Value of a filtered pixel without texture.
        self.latency = 3

        # # #

        pass_position(self, self.sink, self.source, self.latency, valid=self.sink.valid & self.sink.cost)
        for new_left, new_right, target in [
            (self.sink.left,     self.sink.right,     self.source.enter),
            (self.sink.left_old, self.sink.right_old, self.source.leave),
        ]:
            left = Signal(bits)
            self.sync += If(self.sink.valid & self.sink.move_left, left.eq(new_left))
            rights = []
            for _ in range(parameters.disparities):
                right = Signal(bits)
                self.sync += If(self.sink.valid & self.sink.move_right, right.eq(rights[-1] if rights else new_right))
                rights.append(right)
            if lanes > parameters.disparities:
                rights.append(self.cap)
            for lane, right in zip(lanes_of(target, lanes), rights):
                # Difference with its sign, then its magnitude: x if positive, ~x + 1 if negative.
                difference = Signal(bits + 1)
                negative   = difference[-1]
                magnitude  = Signal(bits)
                self.sync += difference.eq(left - right)
                self.sync += magnitude.eq((difference[:bits] ^ Replicate(negative, bits)) + negative)
                self.comb += lane.eq(magnitude)
