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

# Verdict ------------------------------------------------------------------------------------------

@ResetInserter()
class Verdict(LiteXModule):
    """From the costs of a block to its disparity: winner, tests of texture and uniqueness, fraction of a pixel.

    The winner is known some clocks after the costs. What looks at the costs again, for the uniqueness and for the
    fraction, takes them from a delay, all at one time:

        costs ──┬─> Winner ─────┬─> CostLimit ──┬─> Uniqueness ──────────────┐
                │               └─ (delay) ─────┼──────────────┬─> Subpixel ─┴─> winner
                └─> CostDelay ──────────────────┴─> Neighbours ┘

    Only complete blocks come out.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(lanes_layout("costs", parameters.cost_bits, parameters)) # Pipeline.
        self.source = stream.Endpoint(winner_layout(parameters))                               # Pipeline.

        self.disparities       = Signal(max=parameters.disparities + 1)   # Disparities in use.
        self.texture_threshold = Signal(TEXTURE_BITS)                     # Least texture of a block.
        self.uniqueness_ratio  = Signal(max=MAX_UNIQUENESS_RATIO + 1)     # Percent; 0: no test.
        self.subpixel          = Signal()                                 # Fractions of a pixel.

        # # #

        features = parameters.features
        lanes    = parameters.disparities
        costs    = self.sink.costs[:lanes*parameters.cost_bits]
        valid    = self.sink.valid & self.sink.complete

        # Winner.
        # -------
        self.winner = winner = Winner(parameters)
        self.comb += [
            winner.sink.valid.eq(valid),
            winner.sink.costs.eq(costs),
            winner.disparities.eq(self.disparities),
        ]
        latency = winner.latency
        index   = winner.source.index
        cost    = winner.source.cost

        # Costs again, as soon as all is known that they are looked at for.
        # -----------------------------------------------------------------
        tested, fine = "uniqueness" in features, "subpixel" in features
        if tested:
            self.limit = CostLimit(parameters)
            self.comb += [
                self.limit.sink.cost.eq(cost),
                self.limit.ratio.eq(self.uniqueness_ratio),
            ]
            index    = delayed(self, index, self.limit.latency)
            cost     = delayed(self, cost,  self.limit.latency)
            latency += self.limit.latency
        if tested or fine:
            self.cost_delay = CostDelay(parameters, latency)
            self.comb += self.cost_delay.sink.eq(costs)

        # Fraction.
        # ---------
        done      = latency
        disparity = Signal(len(self.source.disparity))
        if fine:
            self.neighbours = neighbours = Neighbours(parameters)
            self.step       = step       = Subpixel(parameters)
            done += neighbours.latency + step.latency
            self.comb += [
                neighbours.sink.costs.eq(self.cost_delay.source),
                neighbours.sink.index.eq(index),
                neighbours.source.connect(step.sink, keep={"below", "above"}),
                step.sink.index.eq(delayed(self, index, neighbours.latency)),
                step.sink.cost.eq(delayed(self, cost, neighbours.latency)),
                step.disparities.eq(self.disparities),
                step.enable.eq(self.subpixel),
                disparity.eq(step.source.disparity),
            ]

        # Tests.
        # ------
        found = []
        if tested:
            self.uniqueness = uniqueness = Uniqueness(parameters)
            done = max(done, latency + uniqueness.latency)
            self.comb += [
                uniqueness.sink.costs.eq(self.cost_delay.source),
                uniqueness.sink.index.eq(index),
                uniqueness.sink.limit.eq(self.limit.source.limit),
                uniqueness.disparities.eq(self.disparities),
            ]
            unique = uniqueness.source.unique | (self.uniqueness_ratio == 0)
            found.append(delayed(self, unique, done - latency - uniqueness.latency))
        if "texture" in features:
            textured = Signal()
            self.sync += textured.eq(lanes_of(self.sink.costs, lanes + 1)[lanes] >= self.texture_threshold)
            found.append(delayed(self, textured, done - 1))
        if not fine:
            self.comb += disparity[DISPARITY_SHIFT:].eq(delayed(self, index, done - latency))

        # Result.
        # -------
        self.latency = done
        self.comb += [
            self.source.valid.eq(delayed(self, valid, done)),
            self.source.found.eq(reduce(and_, found, 1)),
            self.source.disparity.eq(disparity),
            self.source.cost.eq(delayed(self, cost, done - latency)),
        ]
