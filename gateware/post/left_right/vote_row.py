#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Vote Row -----------------------------------------------------------------------------------------

def item(endpoint, layout):
    """Return the fields of `layout` as one number."""
    return Cat(*[getattr(endpoint, name) for name, *_ in layout])

@ResetInserter()
class VoteRow(LiteXModule):
    """For each column of a row of the right image, the cheapest winner that leads to it.

    While `voting` is 1 winners vote, one per clock: the smallest cost keeps a column, and of equal costs the first.
    While it is 0, columns are looked up and forgotten, two of each per clock: an even one and an odd one, in a
    memory each. What a memory holds outlives a reset: `LeftRight` wipes it when a frame begins.
    """
    def __init__(self, parameters):
        layout      = winner_layout(parameters)
        bits        = sum(width for _, width in layout)
        depth       = (parameters.max_width + 1)//2
        column_bits = bits_for(parameters.max_width - 1)
        self.voting      = Signal()                                            # Winners vote; else look-ups.
        self.vote        = stream.Endpoint(layout + [("column", column_bits)]) # Pipeline.
        self.look_up     = [Signal(max=depth, name="even"), Signal(max=depth, name="odd")] # Columns, halved.
        self.holds       = [stream.Endpoint(layout), stream.Endpoint(layout)]  # Their winners, two clocks later.
        self.clear       = Signal()                                            # Forget a column pair.
        self.column_pair = Signal(max=depth)                                   # Its number.

        # # #

        writing, written, stored = self.add_vote(layout, bits)
        data = self.add_memories(layout, bits, depth, writing, written)
        self.comb += stored.eq(Mux(writing.column[0], data[1], data[0]))

    def add_vote(self, layout, bits):
        """Compare a vote with what its column holds, where the two votes before it are not in memory yet.

        Return the vote, what is written, and the Signal that takes what memory holds.
        """
        next_vote = stream.Endpoint(self.vote.description)
        writing   = stream.Endpoint(self.vote.description)
        for before, after in [(self.vote, next_vote), (next_vote, writing)]:
            self.sync += [after.valid.eq(before.valid), after.payload.eq(before.payload)]
        written     = Signal(bits)
        previous    = delayed(self, written, 1)
        last_valid  = delayed(self, writing.valid, 1)
        last_column = delayed(self, writing.column, 1)
        same        = Signal() # As the column of the vote before,
        same_last   = Signal() # and of the one before that.
        self.sync += [
            same.eq((next_vote.column == writing.column) & writing.valid),
            same_last.eq((next_vote.column == last_column) & last_valid),
        ]
        stored = Signal(bits) # What memory holds,
        held   = Signal(bits) # and with those two votes.
        holds  = stream.Endpoint(layout)
        wins   = Signal()
        self.comb += [
            If(same,
                held.eq(previous)
            ).Elif(same_last,
                held.eq(delayed(self, previous, 1))
            ).Else(
                held.eq(stored)
            ),
            item(holds, layout).eq(held),
            wins.eq(writing.found & (~holds.found | (writing.cost < holds.cost))),
            written.eq(Mux(wins, item(writing, layout), held)),
        ]
        return writing, written, stored

    def add_memories(self, layout, bits, depth, writing, written):
        """Build the memories of even and of odd columns; return what they show."""
        data = []
        for parity in range(2):
            memory = Memory(bits, depth, name=f"votes_{('even', 'odd')[parity]}")
            read   = memory.get_port(mode=READ_FIRST)
            write  = memory.get_port(write_capable=True, mode=READ_FIRST)
            self.specials += memory, read, write
            data.append(delayed(self, read.dat_r, 1))
            self.comb += [
                read.adr.eq(Mux(self.voting, self.vote.column[1:], self.look_up[parity])),
                write.adr.eq(Mux(self.voting, writing.column[1:], self.column_pair)),
                write.dat_w.eq(Mux(self.voting, written, 0)),
                write.we.eq(Mux(self.voting, writing.valid & (writing.column[0] == parity), self.clear)),
                item(self.holds[parity], layout).eq(data[parity]),
            ]
        return data
