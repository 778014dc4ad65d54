#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Winner -------------------------------------------------------------------------------------------

@ResetInserter()
class Winner(LiteXModule):
    """Winner-takes-all: the disparity of the smallest cost, and of equal costs the largest disparity.

    A tree of comparators, a register after each level. The tie rule is cv2.StereoBM's, which scans from the largest
    disparity down and keeps the first. Lanes from `disparities` up are unused: their cost counts as all ones, more than
    any block can cost.
    """
    def __init__(self, parameters):
        lanes, bits = parameters.disparities, parameters.cost_bits
        self.sink   = stream.Endpoint([("costs", lanes*bits)]) # Pipeline.
        self.source = stream.Endpoint([
            ("index", parameters.index_bits), # Winning lane.
            ("cost",  bits),                  # Its cost.
        ])                                    # Pipeline.

        self.disparities = Signal(max=lanes + 1) # Disparities in use.
        self.latency     = 1 + log2_int(lanes, need_pow2=False) # The mask of unused lanes, and the levels of the tree.

        # # #

        # Tree: in groups of 16 lanes first, then among the groups in use.
        # ----------------------------------------------------------------
        winners = []
        for group in range(0, lanes, MIN_DISPARITIES):
            lanes_here = lanes_of(self.sink.costs, lanes)[group:group + MIN_DISPARITIES]
            cost, index = self.best([(cost, group + number) for number, cost in enumerate(lanes_here)])
            used        = Signal()
            masked      = Signal(bits, reset_less=True)
            self.sync += [
                used.eq(self.disparities > group),
                masked.eq(cost | Replicate(~used, bits)),
            ]
            winners.append((masked, delayed(self, index, 1)))
        cost, index = self.best(winners)
        self.comb += [
            self.source.valid.eq(delayed(self, self.sink.valid, self.latency)),
            self.source.cost.eq(cost),
            self.source.index.eq(index),
        ]

    def best(self, candidates):
        """Return cost and index of the best of some (cost, index), a register after each level of the tree."""
        while len(candidates) > 1:
            winners = []
            for (low_cost, low_index), (high_cost, high_index) in zip(candidates[0::2], candidates[1::2]):
                index_bits = bits_for(high_index) if isinstance(high_index, int) else len(high_index)
                cost       = Signal(len(low_cost), reset_less=True)
                index      = Signal(index_bits, reset_less=True)
                # `<` instead of `<=` saves the equality comparator.
                self.sync += If(low_cost < high_cost,
                    cost.eq(low_cost),
                    index.eq(low_index)
                ).Else(
                    cost.eq(high_cost),
                    index.eq(high_index)
                )
                winners.append((cost, index))
            if len(candidates) % 2:
                cost, index = candidates[-1]
                winners.append((delayed(self, cost, 1), delayed(self, index, 1)))
            candidates = winners
        return candidates[0]
