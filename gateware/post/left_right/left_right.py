#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common         import *
from .left_right_check import LeftRightCheck
from .vote_row         import VoteRow

# Left Right ---------------------------------------------------------------------------------------

FIFO_DEPTH = 16

# From the last winner of a row until the rows may swap: the register of its vote, the two of `VoteRow`, the write, and
# one to spare.
SWAP_CLOCKS = 1 + 2 + 1 + 1

@ResetInserter()
class LeftRight(LiteXModule):
    """Left-right check: refuse a winner that leads to columns of the right image which belong to other disparities.

    It is cv2.StereoBM's disp12MaxDiff. In a first pass over a row each winner votes for the column of the right image
    that it leads to. In a second pass, `LeftRightCheck`, the winners are compared with the votes. There are two rows of
    votes: while the winners of a row vote, those of the row before are checked. Then the rows swap.

    While `left_right` is 1, a row of the sink has `outer` winners more on either side than a row of the source. The
    outer winners vote but do not come out; the very first one does not vote either.
    """
    def __init__(self, parameters):
        layout  = winner_layout(parameters)
        columns = parameters.max_width
        self.sink    = stream.Endpoint(layout) # Winners, row by row.
        self.source  = stream.Endpoint(layout) # Those of the valid region, fewer found.
        self.latency = None                    # Depends on the settings: with the check, a row and more.

        self.width           = Signal(max=columns + 1)                  # Columns of the frame.
        self.disparities     = Signal(max=parameters.disparities + 1)   # Disparities in use.
        self.min_disparity   = Signal(max=MAX_MIN_DISPARITY + 1)        # Smallest disparity.
        self.outer           = Signal(max=max(parameters.outer, 1) + 1) # Winners on either side that do not come out.
        self.left_right      = Signal()                                 # Check, or pass on.
        self.disp12_max_diff = Signal(max=MAX_DISP12_MAX_DIFF + 1)      # Largest difference in pixels.
        self.begin           = Signal()                                 # Start a frame (pulse).

        # # #

        if "left_right" not in parameters.features:
            self.comb += self.sink.connect(self.source)
            return

        # Thresholds, registered: the settings are stable before the first comparison counts.
        # -----------------------------------------------------------------------------------
        last       = Signal(max=columns) # Last winner of a row.
        last_right = Signal(max=columns) # Last column that one can lead to.
        self.sync += [
            last.eq(self.width - self.disparities - self.min_disparity),
            last_right.eq(self.width - self.min_disparity - 1),
        ]

        # Both passes.
        # ------------
        self.second_pass = second_pass = LeftRightCheck(parameters)
        self.rows        = [VoteRow(parameters), VoteRow(parameters)]
        self.submodules += self.rows
        second_pass.add_thresholds(last, last_right, self.outer, self.disparities, self.disp12_max_diff)
        self.add_first_pass(columns, last)
        self.add_memory(columns)
        self.add_votes()
        self.add_output(layout)

    def add_first_pass(self, columns, last):
        """Take the winners of a row, then swap the rows when the second pass has ended."""
        second_pass      = self.second_pass
        self.voting      = voting = Signal()                                # Row of votes of the first pass.
        self.votes       = votes  = Signal()                                # Winners are taken.
        self.wipe        = wipe   = Signal()                                # Forget all votes, in both rows.
        self.wiped       = wiped  = Signal.like(second_pass.column_pair)    # Pair of columns that is forgotten.
        self.step        = step   = Signal(max=columns)                     # Winner of the row.
        swap             = Signal(max=SWAP_CLOCKS + 1)
        self.fsm         = fsm    = FSM(reset_state="VOTE")
        fsm.act("WIPE",
            wipe.eq(1),
            NextValue(wiped, wiped + 1),
            If(wiped == second_pass.last_column_pair,
                NextState("VOTE")
            )
        )
        fsm.act("VOTE",
            votes.eq(self.left_right),
            NextValue(swap, 0),
            NextValue(wiped, 0),
            If(votes & self.sink.valid,
                NextValue(step, step + 1),
                If(step == last,
                    NextState("SWAP")
                )
            ),
            If(self.begin & self.left_right,
                NextState("WIPE")
            )
        )
        fsm.act("SWAP",
            NextValue(step, 0),
            If(swap != SWAP_CLOCKS,
                NextValue(swap, swap + 1)
            ).Elif(second_pass.idle,
                second_pass.start.eq(1),
                NextValue(voting, ~voting),
                NextState("VOTE")
            )
        )

    def add_memory(self, columns):
        """Keep the winners from the first pass until the second one, two rows of them."""
        second_pass = self.second_pass
        memory = Memory(1 + len(self.sink.disparity), 2**(bits_for(columns - 1) + 1), name="left_right_winners")
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        read   = memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read
        self.comb += [
            write.adr.eq(Cat(self.step, self.voting)),
            write.dat_w.eq(Cat(self.sink.found, self.sink.disparity)),
            write.we.eq(self.votes & self.sink.valid),
            read.adr.eq(Cat(second_pass.step, ~self.voting)),
            Cat(second_pass.winner.found, second_pass.winner.disparity).eq(read.dat_r),
        ]

    def add_votes(self):
        """Connect the votes to the one row, and the look-ups of the second pass to the other."""
        second_pass = self.second_pass
        vote        = stream.Endpoint(self.rows[0].vote.description)
        rounded     = Signal(len(self.sink.disparity) + 1)
        self.comb += rounded.eq(self.sink.disparity + 2**(DISPARITY_SHIFT - 1))
        self.sync += [
            vote.valid.eq(self.votes & self.sink.valid & (self.step != 0)),
            vote.column.eq(self.step + second_pass.shift - rounded[DISPARITY_SHIFT:]),
            vote.found.eq(self.sink.found),
            vote.disparity.eq(self.sink.disparity),
            vote.cost.eq(self.sink.cost),
        ]
        for number, row in enumerate(self.rows):
            mine = self.voting == number
            self.comb += [
                row.voting.eq(mine & ~self.wipe),
                row.vote.valid.eq(vote.valid & mine),
                row.vote.payload.eq(vote.payload),
                row.clear.eq(self.wipe | second_pass.clear),
                row.column_pair.eq(Mux(self.wipe, self.wiped, second_pass.column_pair)),
            ] + [look_up.eq(asked) for look_up, asked in zip(row.look_up, second_pass.look_up)]
        for parity in range(2):
            self.comb += If(self.voting == 0,
                second_pass.holds[parity].payload.eq(self.rows[1].holds[parity].payload)
            ).Else(
                second_pass.holds[parity].payload.eq(self.rows[0].holds[parity].payload)
            )

    def add_output(self, layout):
        """Lead the winners through both passes, or straight to the source."""
        second_pass = self.second_pass
        self.fifo   = fifo = stream.SyncFIFO(layout, FIFO_DEPTH)
        # Two more than the latency may be under way: the level and the credit are a clock late each.
        self.sync += second_pass.credit.eq(fifo.level < FIFO_DEPTH - second_pass.latency - 2)
        self.comb += [
            second_pass.source.connect(fifo.sink, omit={"ready"}),
            If(self.left_right,
                self.sink.ready.eq(self.votes),
                fifo.source.connect(self.source)
            ).Else(
                self.sink.connect(self.source)
            ),
        ]
