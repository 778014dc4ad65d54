#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from .parameters        import SPAN_BITS, STAMP_BITS
from .trigger_generator import NUMBER_BITS

# Pair Matcher -------------------------------------------------------------------------------------

@ResetInserter()
class PairMatcher(LiteXModule):
    """Find the frames of two sensors that belong together, by their starts, and measure their skew.

    Two starts are a pair if they are `window` clocks apart at most. With a window of half the period of the frames that
    is the nearest one. If the other sensor's start does not come in time, or the same sensor starts again, a frame is
    alone, and the newest start waits: there is never more than one that waits.

    A pair is reported in the clock after its later start: as `paired`, with `flagged` if its skew is above
    `flag_limit`; or as `dropped`, if it is above `drop_limit`. Number, stamps and skew then hold until the next report.

    The number of a pair is that of the trigger, `number`, at its earlier start. Without triggers, in the mode
    `free_running`, it counts earlier starts, of frames that are alone too, from 1 on: so gaps show in both modes.
    """
    def __init__(self):
        self.starts       = [Signal(name=f"{name}_starts") for name in ("left", "right")] # A frame starts (pulses).
        self.now          = Signal(STAMP_BITS)    # Count of clocks.
        self.number       = Signal(NUMBER_BITS)   # Number of the newest trigger,
        self.exposure     = Signal(STAMP_BITS)    # and when it began.
        self.free_running = Signal()              # There are no triggers.
        self.window       = Signal(SPAN_BITS - 1) # Largest skew of a pair, in clocks.
        self.flag_limit   = Signal(SPAN_BITS - 1) # Largest skew of a pair without flag,
        self.drop_limit   = Signal(SPAN_BITS - 1) # and of one that is not dropped.
        self.paired       = Signal()              # A pair is found (pulse),
        self.dropped      = Signal()              # or one that is too far apart (pulse).
        self.flagged      = Signal()              # Its skew is above `flag_limit`.
        self.alone        = [Signal(name=f"{name}_alone") for name in ("left", "right")] # A frame is alone (pulses).
        self.skew         = Signal(SPAN_BITS)     # Clocks from left to right start, two's complement.
        self.pair_number  = Signal(NUMBER_BITS)   # Number of the pair.
        self.exposed      = Signal(STAMP_BITS)    # When its trigger began; 0 in the mode `free_running`.
        self.stamps       = [Signal(STAMP_BITS, name=f"{name}_stamp") for name in ("left", "right")] # Its starts.
        self.latency      = None                  # No stream.

        # # #

        self.add_waiting()
        self.add_pairs()
        self.add_numbers()
        self.add_report()

    def add_waiting(self):
        """Keep the start that waits for the other sensor's."""
        left, right  = self.starts
        self.waits   = Signal()                 # A start waits,
        self.side    = Signal()                 # the right one's.
        self.age     = Signal(SPAN_BITS - 1)    # Clocks since then.
        self.expires = Signal()                 # There is no more time for the other one.
        self.first   = Signal()                 # A start that waits from now on, or two at once (pulse).
        self.both    = Signal()
        self.meets   = Signal()                 # A start of the other sensor (pulse).
        self.comb += [
            self.both.eq(left & right),
            self.meets.eq(self.waits & ~self.both & Mux(self.side, left, right)),
            self.first.eq((left | right) & ~self.meets),
            self.expires.eq(self.waits & ~self.first & ~self.meets & (self.age >= self.window)),
        ]
        self.sync += [
            If(self.first,
                # The next clock is one later.
                self.age.eq(1),
                self.side.eq(right),
                self.waits.eq(~self.both & (self.window != 0))
            ).Else(
                self.age.eq(self.age + 1),
                If(self.meets | self.expires,
                    self.waits.eq(0)
                )
            ),
            # With a window of 0 a start does not wait at all.
            [alone.eq((self.waits & ~self.meets & (self.first | self.expires) & (self.side == number))
                | (start & ~self.both & ~self.meets & (self.window == 0)))
                for number, (alone, start) in enumerate(zip(self.alone, self.starts))],
        ]

    def add_pairs(self):
        """Judge the distance of two starts."""
        self.distance = Signal(SPAN_BITS - 1)
        self.found    = Signal()
        self.comb += [
            self.found.eq(self.both | self.meets),
            self.distance.eq(Mux(self.both, 0, self.age)),
        ]
        drop = Signal()
        self.comb += drop.eq(self.distance > self.drop_limit)
        self.sync += [
            self.paired.eq(self.found & ~drop),
            self.dropped.eq(self.found & drop),
            If(self.found,
                self.flagged.eq(self.distance > self.flag_limit)
            ),
        ]

    def add_numbers(self):
        """Number the pairs and what is alone."""
        self.counted = Signal(NUMBER_BITS) # Earlier starts.
        following    = Signal(NUMBER_BITS)
        self.comb += following.eq(self.counted + 1)
        # Number and trigger of a start that waits.
        self.begun = [Signal(NUMBER_BITS), Signal(STAMP_BITS), Signal(STAMP_BITS)]
        # The same of one that starts in this clock.
        self.fresh = [Signal(NUMBER_BITS), Signal(STAMP_BITS), Signal(STAMP_BITS)]
        self.comb += [
            self.fresh[0].eq(Mux(self.free_running, following, self.number)),
            self.fresh[1].eq(Mux(self.free_running, 0, self.exposure)),
            self.fresh[2].eq(self.now),
        ]
        self.sync += If(self.first,
            self.counted.eq(following),
            [kept.eq(fresh) for kept, fresh in zip(self.begun, self.fresh)]
        )

    def add_report(self):
        """Report a pair: of two starts at once, or of one that has waited and one of this clock."""
        number, exposed, stamp = [Mux(self.both, fresh, kept) for fresh, kept in zip(self.fresh, self.begun)]
        negative = Signal(SPAN_BITS)
        self.comb += negative.eq(-Cat(self.distance, 0))
        self.sync += If(self.found,
            self.pair_number.eq(number),
            self.exposed.eq(exposed),
            self.stamps[0].eq(Mux(self.side & ~self.both, self.now, stamp)),
            self.stamps[1].eq(Mux(self.side | self.both, stamp, self.now)),
            # The right one came first: the skew is negative.
            self.skew.eq(Mux(self.side & ~self.both, negative, self.distance))
        )
