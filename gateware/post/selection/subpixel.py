#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Neighbours ---------------------------------------------------------------------------------------

@ResetInserter()
class Neighbours(LiteXModule):
    """The costs of the two lanes next to the winner.

    They are two lanes apart, so lanes whose numbers are equal modulo 4 share a multiplexer: at most one of the two is
    among them. At the ends of the range one of the neighbours is undefined.
    """
    def __init__(self, parameters):
        lanes, bits = parameters.disparities, parameters.cost_bits
        self.sink = stream.Endpoint([
            ("costs", lanes*bits),
            ("index", parameters.index_bits), # Winning lane.
        ])                                    # Pipeline.
        self.source = stream.Endpoint([
            ("below", bits), # Cost of the lane below the winner's.
            ("above", bits), # Cost of the lane above.
        ])                   # Pipeline.
        self.latency = 4         # Costs, one of four, one of those, below or above.

        # # #

        below = Signal(parameters.index_bits + 1)
        above = Signal(parameters.index_bits + 1)
        self.comb += [
            below.eq(self.sink.index - 1),
            above.eq(self.sink.index + 1),
        ]
        # Register the costs: the lane index fans out to all of them.
        costs  = delayed(self, self.sink.costs, 1)
        chosen = []
        for bank in range(4):
            values = lanes_of(costs, lanes)[bank::4]
            number = Signal(max=len(values), reset_less=True)
            halves = []
            self.sync += number.eq(Mux(below[:2] == bank, below[2:], above[2:]))
            # In two levels: one of four lanes, then one of those.
            for begin in range(0, len(values), 4):
                half = Signal(bits, reset_less=True)
                self.sync += Case(number[:2], {lane: half.eq(values[begin + lane]) for lane in range(4)})
                halves.append(half)
            value = Signal(bits, reset_less=True)
            self.sync += Case(delayed(self, number[2:] if len(number) > 2 else Signal(), 1),
                {part: value.eq(half) for part, half in enumerate(halves)} | {"default": value.eq(halves[-1])})
            chosen.append(value)
        for name, lane in [("below", below), ("above", above)]:
            self.sync += Case(delayed(self, lane[:2], 3),
                {bank: getattr(self.source, name).eq(value) for bank, value in enumerate(chosen)})
        self.comb += self.source.valid.eq(delayed(self, self.sink.valid, self.latency))

# Subpixel -----------------------------------------------------------------------------------------

QUOTIENT_BITS = 8 # Of the offset: 1/256 pixel, up to 128.

@ResetInserter()
class Subpixel(LiteXModule):
    """Disparity in sixteenths of a pixel, from the costs p and q below and above the winner's s.

    cv2.StereoBM's offset is (p - q)*256/(p + q - 2*s + |p - q|), rounded toward zero. As s is the smallest, that is
    128*|p - q|/max(p - s, q - s) with a sign: at most 128, so a division of eight steps, a clock each. Winners at the
    ends of the range keep their whole number of pixels.
    """
    def __init__(self, parameters):
        bits, index_bits = parameters.cost_bits, parameters.index_bits
        self.sink = stream.Endpoint([
            ("index", index_bits), # Winning lane.
            ("cost",  bits),       # Its cost s,
            ("below", bits),       # p of the lane below,
            ("above", bits),       # and q of the lane above.
        ])                         # Pipeline.
        self.source      = stream.Endpoint([("disparity", index_bits + DISPARITY_SHIFT)]) # Pipeline.
        self.disparities = Signal(max=parameters.disparities + 1)                         # Disparities in use.
        self.enable      = Signal()                                                       # 0: whole pixels.
        self.latency     = 2 + QUOTIENT_BITS + 2                                          # Operands, division, sum.

        # # #

        remainder, denominator, negative = self.add_operands(parameters)
        quotient = self.add_division(parameters, remainder, denominator)
        self.add_sum(index_bits, quotient, negative)

    def add_operands(self, parameters):
        """Return numerator and denominator, at clock 2, and whether the offset is negative, at clock 1."""
        bits       = parameters.cost_bits
        rise, fall = [Signal(bits, reset_less=True) for _ in range(2)] # p - s, q - s
        gap        = Signal((bits + 1, True), reset_less=True)         # p - q
        inside     = Signal()
        last       = Signal(parameters.index_bits)
        negative   = Signal()
        self.sync += last.eq(self.disparities - 1)
        self.sync += [
            rise.eq(self.sink.below - self.sink.cost),
            fall.eq(self.sink.above - self.sink.cost),
            gap.eq(self.sink.below - self.sink.above),
            inside.eq((self.sink.index != 0) & (self.sink.index != last) & self.enable),
        ]
        remainder   = Signal(bits, reset_less=True)
        denominator = Signal(bits, reset_less=True)
        positive    = Signal(bits)
        self.comb += [
            negative.eq(gap[-1]),
            positive.eq(fall - rise),
        ]
        self.sync += [
            remainder.eq(0),
            denominator.eq(Mux(negative, fall, rise)),
            If(inside,
                remainder.eq(Mux(negative, positive, gap[:bits]))
            ),
        ]

        return remainder, denominator, negative

    def add_division(self, parameters, remainder, denominator):
        """Return the quotient. Long division: a bit per clock, the highest first."""
        bits     = parameters.cost_bits
        quotient = None
        for step in range(QUOTIENT_BITS):
            difference       = Signal(bits + 2)
            fits             = Signal()
            scaled           = Signal(bits + 1)
            next_remainder   = Signal(bits, reset_less=True)
            next_denominator = Signal(bits, reset_less=True)
            digits           = Signal(step + 1, reset_less=True)
            # The first digit is that of 128 and compares the remainder as it is; each later one doubles it first.
            self.comb += [
                scaled.eq(remainder if quotient is None else remainder << 1),
                difference.eq(scaled - denominator),
                fits.eq(~difference[-1] & (denominator != 0)),
            ]
            self.sync += [
                next_remainder.eq(Mux(fits, difference[:bits], scaled[:bits])),
                next_denominator.eq(denominator),
                digits.eq(fits if quotient is None else Cat(fits, quotient)),
            ]
            remainder, denominator, quotient = next_remainder, next_denominator, digits
        return quotient

    def add_sum(self, index_bits, quotient, negative):
        """Add the fraction to the whole pixels, rounded as OpenCV does."""
        index = delayed(self, self.sink.index, 2 + QUOTIENT_BITS)
        minus = delayed(self, negative, 1 + QUOTIENT_BITS)
        total = Signal(index_bits + QUOTIENT_BITS + 1, reset_less=True)
        fine  = Signal(index_bits + QUOTIENT_BITS + 1)
        self.comb += fine.eq(Cat(Replicate(1, DISPARITY_SHIFT), Replicate(0, QUOTIENT_BITS - DISPARITY_SHIFT), index))
        self.sync += [
            total.eq(Mux(minus, fine - quotient, fine + quotient)),
            self.source.disparity.eq(total[QUOTIENT_BITS - DISPARITY_SHIFT:]),
        ]
        self.comb += self.source.valid.eq(delayed(self, self.sink.valid, self.latency))
