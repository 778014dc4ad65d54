#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common import *

# Winner -------------------------------------------------------------------------------------------

@ResetInserter()
class Winner(LiteXModule):
    """Winner-takes-all: the disparity of the smallest cost, and of equal costs the largest disparity.

    A tree of comparators, a register after each level. The tie rule is cv2.StereoBM's, which scans from the largest
    disparity down and keeps the first. Lanes from `disparities` up are out of use: their cost counts as all ones, more
    than any block can cost. Only complete blocks come out.
    """
    def __init__(self, max_width=640, disparities=64, max_block_size=9):
        bits       = cost_bits(max_block_size)
        index_bits = bits_for(disparities - 1)
        levels     = log2_int(disparities, need_pow2=False)
        self.sink   = stream.Endpoint(lanes_layout("costs", disparities, bits, max_width)) # Pipeline.
        self.source = stream.Endpoint([
            ("index", index_bits), # Winning disparity in pixels.
            ("cost",  bits),       # Its cost.
        ])                         # Pipeline.

        self.disparities = Signal(max=disparities + 1) # Disparities in use.
        self.latency     = 1 + levels

        # # #

        # Lanes out of use, by groups of 16.
        # ----------------------------------
        candidates = []
        for group in range(0, disparities, 16):
            used = Signal()
            self.sync += used.eq(self.disparities > group)
            for lane in lanes_of(self.sink.costs, disparities)[group:group + 16]:
                cost = Signal(bits)
                self.sync += cost.eq(lane | Replicate(~used, bits))
                candidates.append((cost, len(candidates)))

        # Tree.
        # -----
        while len(candidates) > 1:
            winners = []
            for (low_cost, low_index), (high_cost, high_index) in zip(candidates[0::2], candidates[1::2]):
                cost  = Signal(bits)
                index = Signal(index_bits)
                self.sync += If(high_cost <= low_cost,
                    cost.eq(high_cost),
                    index.eq(high_index)
                ).Else(
                    cost.eq(low_cost),
                    index.eq(low_index)
                )
                winners.append((cost, index))
            if len(candidates) % 2:
                cost  = Signal(bits)
                index = Signal(index_bits)
                self.sync += [
                    cost.eq(candidates[-1][0]),
                    index.eq(candidates[-1][1]),
                ]
                winners.append((cost, index))
            candidates = winners

        # Valid.
        # ------
        valid = self.sink.valid & self.sink.complete
        for _ in range(self.latency):
            delayed = Signal()
            self.sync += delayed.eq(valid)
            valid = delayed
        cost, index = candidates[0]
        self.comb += [
            self.source.valid.eq(valid),
            self.source.cost.eq(cost),
            self.source.index.eq(index),
        ]
