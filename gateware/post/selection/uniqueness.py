#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Cost Limit ---------------------------------------------------------------------------------------

PERCENT = 100

def reciprocal(divisor, largest):
    """Return factor and shift such that x//divisor == x*factor >> shift for all x up to `largest`.

    After Granlund and Montgomery, 1994.
    """
    shift = divisor.bit_length()
    while True:
        factor = -(-2**shift//divisor)
        if (factor*divisor - 2**shift)*largest < 2**shift:
            return factor, shift
        shift += 1

@ResetInserter()
class CostLimit(LiteXModule):
    """cost + floor(cost*ratio/100): a rival has to cost more than that."""
    def __init__(self, parameters):
        bits = parameters.cost_bits
        self.sink    = stream.Endpoint([("cost",  bits)])     # Pipeline.
        self.source  = stream.Endpoint([("limit", bits + 1)]) # Pipeline.
        self.ratio   = Signal(max=MAX_UNIQUENESS_RATIO + 1)   # Uniqueness ratio in percent.
        self.latency = 4                                      # Product, its parts, their sum, limit.

        # # #

        # The product without its two lowest bits is to be divided by 25: that keeps the factors short.
        largest       = (2**bits - 1)*MAX_UNIQUENESS_RATIO
        product       = Signal(max=largest + 1, reset_less=True)
        quarters      = product[2:]
        factor, shift = reciprocal(PERCENT//4, largest//4)
        half          = len(quarters)//2
        low           = Signal(max=2**half*factor, reset_less=True)
        high          = Signal(max=2**(len(quarters) - half)*factor, reset_less=True)
        total         = Signal(len(quarters) + bits_for(factor), reset_less=True)
        cost          = delayed(self, self.sink.cost, 3)
        self.sync += [
            product.eq(self.sink.cost*self.ratio),
            low.eq(quarters[:half]*factor),
            high.eq(quarters[half:]*factor),
            total.eq(low + (high << half)),
            self.source.limit.eq(cost + total[shift:]),
        ]
        self.comb += self.source.valid.eq(delayed(self, self.sink.valid, self.latency))

# Uniqueness ---------------------------------------------------------------------------------------

@ResetInserter()
class Uniqueness(LiteXModule):
    """Whether all rivals of the winner, all lanes but it and its two neighbours, cost more than the limit."""
    def __init__(self, parameters):
        lanes, bits = parameters.disparities, parameters.cost_bits
        self.sink = stream.Endpoint([
            ("costs", lanes*bits),
            ("index", parameters.index_bits), # Winning lane.
            ("limit", bits + 1),
        ])                                                  # Pipeline.
        self.source      = stream.Endpoint([("unique", 1)]) # Pipeline.
        self.disparities = Signal(max=lanes + 1)            # Disparities in use.
        self.latency     = 3                                # Cheap lanes, rivals of a group, all of them.

        # # #

        # Lanes cheap enough to be a rival, and the winner, one bit per lane.
        # -------------------------------------------------------------------
        cheap  = Signal(lanes, reset_less=True)
        winner = Signal(lanes, reset_less=True)
        used   = Signal(lanes//MIN_DISPARITIES)
        self.sync += [used[group].eq(self.disparities > MIN_DISPARITIES*group) for group in range(len(used))]
        for lane, cost in enumerate(lanes_of(self.sink.costs, lanes)):
            self.sync += [
                # `<` instead of `<=` saves the equality comparator.
                cheap[lane].eq(~(self.sink.limit < cost) & used[lane//MIN_DISPARITIES]),
                winner[lane].eq(self.sink.index == lane),
            ]

        # Rivals.
        # -------
        near = Signal(lanes + 2)
        self.comb += near.eq(winner | (winner << 1) | (winner << 2))
        groups = []
        for begin in range(0, lanes, MIN_DISPARITIES):
            rivals = Signal()
            part   = slice(begin, begin + MIN_DISPARITIES)
            self.sync += rivals.eq((cheap[part] & ~near[1:1 + lanes][part]) != 0)
            groups.append(rivals)
        self.sync += self.source.unique.eq(Cat(*groups) == 0)
        self.comb += self.source.valid.eq(delayed(self, self.sink.valid, self.latency))
