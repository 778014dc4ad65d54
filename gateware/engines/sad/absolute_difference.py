#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common       import *
from ..costs          import *
from .difference_pair import difference_pair_layout

# Absolute Difference ------------------------------------------------------------------------------

@ResetInserter()
class AbsoluteDifference(LiteXModule):
    """|left(x) - right(x - d)| for all disparities d at once, of the row that enters and the row that leaves.

    The right pixels wait in shift registers, one stage per disparity. The lane after that of the last disparity is the
    texture, |left(x) - cap|. Only steps that have a cost come out.

    A lane is a number with a carry (`with_carry`). The magnitude of a negative difference is its bits inverted, plus 1:
    the inverted bits are the value, that 1 is the carry.
    """
    def __init__(self, parameters):
        bits, lanes = parameters.filtered_bits, parameters.lanes
        self.sink   = stream.Endpoint(positioned_pair_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint(difference_pair_layout(parameters)) # Pipeline: steps that have a cost.

        self.cap     = Signal(max=MAX_PREFILTER_CAP + 1) # Value of a filtered pixel without texture.
        self.latency = 2                                 # Pixels, difference.

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
                difference = Signal(bits + 1, reset_less=True)
                negative   = difference[-1]
                self.sync += difference.eq(left - right)
                self.comb += lane.eq(with_carry(difference[:bits] ^ Replicate(negative, bits), negative))
