#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from functools import reduce
from operator  import and_

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common        import *
from ...engines.costs import *
from .cost_delay      import CostDelay
from .subpixel        import Neighbours, Subpixel
from .uniqueness      import CostLimit, Uniqueness
from .winner          import Winner

# Selection ----------------------------------------------------------------------------------------

@ResetInserter()
class Selection(LiteXModule):
    """From the costs of a block to its disparity: winner, tests of texture and uniqueness, fraction of a pixel.

    The winner is known some clocks after the costs. Uniqueness and fraction need the costs again: they get them from a
    delay, both at the same time.

        costs ──┬─> Winner ─────┬─> CostLimit ──┬─> Uniqueness ──────────────┐
                │               └─ (delay) ─────┼──────────────┬─> Subpixel ─┴─> winner
                └─> CostDelay ──────────────────┴─> Neighbours ┘

    Clocks of each part, and from the costs to its end, for 64 disparities and all features. A feature that is not built
    adds no clocks; the result leaves when the last of its parts is done.

        part        feature     clocks                    from   to
        Winner                  1 + ceil(log2(lanes))        0    7
        CostLimit   uniqueness  4                            7   11
        CostDelay               as long as both above        0   11
        Uniqueness  uniqueness  3                           11   14
        Neighbours  subpixel    4                           11   15
        Subpixel    subpixel    12                          15   27
        texture     texture     1                            0    1

    Only complete blocks come out.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(cost_layout(parameters))   # Pipeline.
        self.source = stream.Endpoint(winner_layout(parameters)) # Pipeline: complete blocks.

        self.disparities       = Signal(max=parameters.disparities + 1) # Disparities in use.
        self.texture_threshold = Signal(TEXTURE_BITS)                   # Least texture of a block.
        self.uniqueness_ratio  = Signal(max=MAX_UNIQUENESS_RATIO + 1)   # Percent; 0: no test.
        self.subpixel          = Signal()                               # Fractions of a pixel.

        # # #

        features = parameters.features
        costs    = self.sink.costs[:parameters.disparities*parameters.cost_bits]
        valid    = self.sink.valid & self.sink.complete

        # Winner, and the costs again when it is known.
        # ---------------------------------------------
        index, cost, known = self.add_winner(parameters, costs, valid)
        if "uniqueness" in features:
            index, cost, known = self.add_cost_limit(parameters, index, cost, known)
        if features & {"uniqueness", "subpixel"}:
            self.cost_delay = CostDelay(parameters, known)
            self.comb += self.cost_delay.sink.eq(costs)

        # Disparity and tests, each with the clock in which it is done.
        # -------------------------------------------------------------
        disparity, done = index, known
        result          = self.source.disparity[DISPARITY_SHIFT:] # Whole pixels,
        if "subpixel" in features:
            disparity, done = self.add_fraction(parameters, index, cost, known)
            result          = self.source.disparity               # or sixteenths.
        tests = []
        if "uniqueness" in features:
            tests.append(self.add_uniqueness(parameters, index, known))
        if "texture" in features:
            tests.append(self.add_texture(parameters))

        # Result: all at the clock of the last.
        # -------------------------------------
        self.latency = max([done] + [clock for _, clock in tests])
        found        = [delayed(self, test, self.latency - clock) for test, clock in tests]
        self.comb += [
            self.source.valid.eq(delayed(self, valid, self.latency)),
            self.source.found.eq(reduce(and_, found, 1)),
            self.source.cost.eq(delayed(self, cost, self.latency - known)),
            result.eq(delayed(self, disparity, self.latency - done)),
        ]

    def add_winner(self, parameters, costs, valid):
        """Return lane and cost of the winner, and the clock in which they are known."""
        self.winner = winner = Winner(parameters)
        self.comb += [
            winner.sink.valid.eq(valid),
            winner.sink.costs.eq(costs),
            winner.disparities.eq(self.disparities),
        ]
        return winner.source.index, winner.source.cost, winner.latency

    def add_cost_limit(self, parameters, index, cost, known):
        """Start the limit for rivals; return lane, cost and clock for when it is known."""
        self.limit = limit = CostLimit(parameters)
        self.comb += [
            limit.sink.cost.eq(cost),
            limit.ratio.eq(self.uniqueness_ratio),
        ]
        return delayed(self, index, limit.latency), delayed(self, cost, limit.latency), known + limit.latency

    def add_fraction(self, parameters, index, cost, known):
        """Return the disparity in sixteenths of a pixel, and the clock in which it is done."""
        self.neighbours = neighbours = Neighbours(parameters)
        self.fraction   = fraction   = Subpixel(parameters)
        self.comb += [
            neighbours.sink.costs.eq(self.cost_delay.source),
            neighbours.sink.index.eq(index),
            neighbours.source.connect(fraction.sink, keep={"below", "above"}),
            fraction.sink.index.eq(delayed(self, index, neighbours.latency)),
            fraction.sink.cost.eq(delayed(self, cost, neighbours.latency)),
            fraction.disparities.eq(self.disparities),
            fraction.enable.eq(self.subpixel),
        ]
        return fraction.source.disparity, known + neighbours.latency + fraction.latency

    def add_uniqueness(self, parameters, index, known):
        """Return whether the winner is unique, or need not be, and the clock in which that is done."""
        self.uniqueness = uniqueness = Uniqueness(parameters)
        self.comb += [
            uniqueness.sink.costs.eq(self.cost_delay.source),
            uniqueness.sink.index.eq(index),
            uniqueness.sink.limit.eq(self.limit.source.limit),
            uniqueness.disparities.eq(self.disparities),
        ]
        return uniqueness.source.unique | (self.uniqueness_ratio == 0), known + uniqueness.latency

    def add_texture(self, parameters):
        """Return whether the block has enough texture, and the clock in which that is done."""
        textured = Signal()
        texture  = lanes_of(self.sink.costs, parameters.lanes)[parameters.disparities]
        self.sync += textured.eq(texture >= self.texture_threshold)
        return textured, 1
