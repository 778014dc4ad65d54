#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from .parameters import SPAN_BITS, STAMP_BITS

NUMBER_BITS = 32 # Of the number of a frame.

# Trigger Generator --------------------------------------------------------------------------------

@ResetInserter()
class TriggerGenerator(LiteXModule):
    """Start the exposure of both sensors at a period, and number the frames.

    The first trigger comes two clocks after `enable`, or after the period of the one before if that has not passed.
    `trigger` is 1 for `width` clocks, which is the exposure of a sensor in snapshot mode. With a width of 0 it stays 0;
    with one of `period` or more it stays 1, and a sensor sees no further edge. Without `enable` no trigger begins, and
    one that has begun ends after its width.

    `stamp` is the value of `now` in the first clock of the trigger, that of `started`. `number` is 1 at the first
    trigger after a reset.
    """
    def __init__(self):
        self.enable  = Signal()            # Begin triggers.
        self.period  = Signal(SPAN_BITS)   # Clocks from trigger to trigger, from 1 up; 0 is as 1.
        self.width   = Signal(SPAN_BITS)   # Clocks of a trigger.
        self.trigger = Signal()            # To the sensors.
        self.started = Signal()            # The first clock of a trigger (pulse).
        self.now     = Signal(STAMP_BITS)  # Clocks since the reset.
        self.stamp   = Signal(STAMP_BITS)  # When the newest trigger began.
        self.number  = Signal(NUMBER_BITS) # Triggers that have begun, modulo 2**NUMBER_BITS.
        self.latency = None                # No stream.

        # # #

        starts = Signal()
        self.sync += self.now.eq(self.now + 1)
        self.add_period(starts)
        self.add_pulse(starts)
        self.add_numbers(starts)

    def add_period(self, starts):
        """Decide when a trigger starts: `starts` is two clocks before its first one."""
        elapsed = Signal(SPAN_BITS, reset=2**SPAN_BITS - 1) # Clocks since the start before, up to the largest number.
        due     = Signal()
        self.comb += [
            due.eq(elapsed >= self.period),
            starts.eq(self.enable & due),
        ]
        self.sync += If(starts,
            elapsed.eq(1)
        ).Elif(elapsed != 2**SPAN_BITS - 1,
            elapsed.eq(elapsed + 1)
        )

    def add_pulse(self, starts):
        """Make the pulse. Its register has no logic after it: a sensor would see its glitches."""
        remaining = Signal(SPAN_BITS)
        self.sync += [
            If(starts,
                remaining.eq(self.width)
            ).Elif(remaining != 0,
                remaining.eq(remaining - 1)
            ),
            self.trigger.eq(remaining != 0),
        ]

    def add_numbers(self, starts):
        """Number the triggers, and stamp them."""
        begins = Signal() # In the next clock.
        self.sync += [
            begins.eq(starts),
            self.started.eq(begins),
            If(begins,
                self.number.eq(self.number + 1),
                self.stamp.eq(self.now + 1)
            ),
        ]
