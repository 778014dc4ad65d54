#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common.parameters import check

FREQUENT = 2 # Events that may come in every second clock: those of datagrams of one word.
SELDOM   = 8 # All others: those of messages, which have at least seven words.

# Numbers of the counters, in the order of their events.
COUNTER_NUMBERS = (*range(FREQUENT), *range(8, 8 + SELDOM))

# Event Counters -----------------------------------------------------------------------------------

class EventCounters(LiteXModule):
    """Count events in one distributed RAM, with one adder for all of them.

    Events are gathered, up to three of a kind, until the adder serves their kind: `FREQUENT` ones every fourth clock,
    the others every sixteenth, and a clock later for each `read` meanwhile. `read` comes in every fourth clock at most:
    software needs longer to write `index` and to read `value`. Then a frequent event is served within 6 clocks, and may
    come in every second one; another is served within 22 clocks, and may come in every eighth one.

    For 16 clocks after a reset the counters are cleared; events meanwhile are counted then, up to three of a kind.
    It is reset with its clock domain alone.

    Parameters
    ----------
    events : list of Signal
        Events (pulses), the frequent ones first. `COUNTER_NUMBERS` has the numbers of their counters.
    """
    def __init__(self, events):
        self.index   = Signal(4)  # Number of the counter to read.
        self.read    = Signal()   # Read it (pulse).
        self.value   = Signal(32) # The counter that was read last, a clock later.
        self.latency = None       # No stream.

        check(len(events) == FREQUENT + SELDOM, f"there are {FREQUENT + SELDOM} events, not {len(events)}.")

        # # #

        self.turn     = Signal(4)       # Place in the round of counters,
        self.number   = Signal(4)       # and the number of that place's counter.
        self.clearing = Signal(reset=1) # The first round after a reset: counters are cleared.
        self.comb += self.number.eq(Cat(self.turn[0], self.turn[2:4] & Replicate(self.turn[1], 2), self.turn[1]))
        self.sync += If(~self.read,
            self.turn.eq(self.turn + 1),
            If(self.turn == 15,
                self.clearing.eq(0)
            )
        )

        gathered = self.add_events(events)
        self.add_memory(gathered)

    def add_events(self, events):
        """Gather events until they are served; return how many are served in this clock."""
        serving  = Signal()
        gathered = [Signal(2, name=f"gathered{n}") for n in range(len(events))]
        self.comb += serving.eq(~self.clearing & ~self.read)
        for number, event, count in zip(COUNTER_NUMBERS, events, gathered):
            served = Signal()
            self.comb += served.eq(serving & (self.number == number))
            self.sync += If(served,
                count.eq(event)
            ).Else(
                count.eq(count + event)
            )
        frequent, seldom = Array(gathered[:FREQUENT]), Array(gathered[FREQUENT:])
        added = Signal(2)
        self.comb += added.eq(Mux(self.turn[1], seldom[self.number[:3]], frequent[self.turn[0]]))
        return added

    def add_memory(self, added):
        """Add what is served to its counter, which is written a clock later; show the counter that software reads."""
        memory = Memory(32, 16, name="event_counters")
        write  = memory.get_port(write_capable=True)
        read   = memory.get_port(async_read=True)
        sum    = Signal(32) # A counter to write,
        place  = Signal(4)  # its number,
        valid  = Signal()   # if there is one.
        self.specials += memory, write, read
        self.comb += [
            read.adr.eq(Mux(self.read, self.index, self.number)),
            write.adr.eq(place),
            write.dat_w.eq(sum),
            write.we.eq(valid),
        ]
        # A reset of the register clears the memory: it needs no logic.
        self.sync += [
            sum.eq(read.dat_r + added),
            If(self.clearing,
                sum.eq(0)
            ),
            place.eq(self.number),
            valid.eq(~self.read),
            If(self.read,
                self.value.eq(read.dat_r)
            ),
        ]
