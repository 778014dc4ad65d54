#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common            import *
from ..costs              import *
from .absolute_difference import AbsoluteDifference
from .block_sum           import BlockSum
from .column_sum          import ColumnSum

# SAD Engine ---------------------------------------------------------------------------------------

@ResetInserter()
class SADEngine(LiteXModule):
    """The engine of block matching: the cost of a disparity is the sum of absolute differences over its block.

    The interface is that of every engine: see `gateware/engines/costs.py` and `Matcher.add_engine`.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(positioned_pair_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint(cost_layout(parameters))            # Pipeline: steps that have a cost.

        self.cap        = Signal(max=MAX_PREFILTER_CAP + 1)         # Value of a filtered pixel without texture.
        self.block_size = Signal(max=parameters.max_block_size + 1) # Side of the block.

        # # #

        self.difference = AbsoluteDifference(parameters)
        self.column_sum = ColumnSum(parameters)
        self.block_sum  = BlockSum(parameters)
        self.latency    = sum(core.latency for core in self.pipeline())
        self.comb += [
            connect_pipeline(self.sink, self.difference.sink),
            connect_pipeline(self.difference.source, self.column_sum.sink),
            connect_pipeline(self.column_sum.source, self.block_sum.sink),
            connect_pipeline(self.block_sum.source, self.source),
            self.difference.cap.eq(self.cap),
            self.block_sum.block_size.eq(self.block_size),
        ]

    def pipeline(self):
        """Return the cores of the engine, in the order in which a step passes them."""
        return [self.difference, self.column_sum, self.block_sum]
