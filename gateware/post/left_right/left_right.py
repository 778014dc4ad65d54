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

FIFO_DEPTH  = 16
TURN_CLOCKS = 5 # From the last vote of a row until it is written.

@ResetInserter()
class LeftRight(LiteXModule):
    """Left-right check: refuse a winner that leads to columns of the right image which belong to other disparities.

    It is cv2.StereoBM's disp12MaxDiff. In a first pass over a row each winner votes for the column of the right image that
    it leads to; in a second one, `LeftRightCheck`, the winners are compared with the votes. The first pass of a row
    runs at the same time as the second one of the row before.

    While `left_right` is 1 the rows that come in have `outer` winners more on either side than those that go out: they
    only vote, but for the very first one, which does not.
    """
    def __init__(self, parameters):
        layout  = winner_layout(parameters)
        columns = parameters.max_width
        self.sink   = stream.Endpoint(layout) # Winners, row by row.
        self.source = stream.Endpoint(layout) # Those of the valid region, fewer found.

        self.width           = Signal(max=columns + 1)                  # Columns of the frame.
        self.disparities     = Signal(max=parameters.disparities + 1)   # Disparities in use.
        self.min_disparity   = Signal(max=MAX_MIN_DISPARITY + 1)        # Smallest disparity.
        self.outer           = Signal(max=max(parameters.outer, 1) + 1) # Winners that only vote.
        self.left_right      = Signal()                                 # Check, or pass on.
        self.disp12_max_diff = Signal(max=MAX_DISP12_MAX_DIFF + 1)      # Largest difference in pixels.
        self.begin           = Signal()                                 # Start a frame (pulse).

        # # #

        if "left_right" not in parameters.features:
            self.comb += self.sink.connect(self.source)
            return

        # Thresholds, registered: the settings are stable before the first comparison counts.
        # -----------------------------------------------------------------------------------
        self.check = check = LeftRightCheck(parameters)
        last       = Signal(max=columns) # Last winner of a row.
        last_right = Signal(max=columns) # Last column that one can lead to.
        largest    = Signal(bits_for(MAX_DISP12_MAX_DIFF) + DISPARITY_SHIFT)
        ceiling    = 2**len(check.difference) - 1
        self.sync += [
            last.eq(self.width - self.disparities - self.min_disparity),
            last_right.eq(self.width - self.min_disparity - 1),
            largest.eq(self.disp12_max_diff << DISPARITY_SHIFT),
            check.difference.eq(Mux(largest > ceiling, ceiling, largest)),
            check.last.eq(last),
            check.first_out.eq(self.outer),
            check.last_out.eq(last - self.outer),
            check.last_pair.eq(last_right[1:]),
            check.shift.eq(self.disparities - 1),
        ]

        # First pass.
        # -----------
        self.rows = rows = [VoteRow(parameters), VoteRow(parameters)]
        self.submodules += rows
        voting = Signal() # Row that is voted for; the other one is checked.
        votes  = Signal() # Winners are taken.
        wipe   = Signal() # Forget all votes, in both rows.
        step   = Signal(max=columns)
        turn   = Signal(max=TURN_CLOCKS + 1)
        pair   = Signal.like(check.pair)
        self.fsm = fsm = FSM(reset_state="VOTE")
        fsm.act("WIPE",
            wipe.eq(1),
            NextValue(pair, pair + 1),
            If(pair == check.last_pair,
                NextState("VOTE")
            )
        )
        fsm.act("VOTE",
            votes.eq(self.left_right),
            NextValue(turn, 0),
            NextValue(pair, 0),
            If(votes & self.sink.valid,
                NextValue(step, step + 1),
                If(step == last,
                    NextState("TURN")
                )
            ),
            If(self.begin & self.left_right,
                NextState("WIPE")
            )
        )
        fsm.act("TURN",
            NextValue(step, 0),
            If(turn != TURN_CLOCKS,
                NextValue(turn, turn + 1)
            ).Elif(check.idle,
                check.start.eq(1),
                NextValue(voting, ~voting),
                NextState("VOTE")
            )
        )

        # Winners: through the two passes, or past them.
        # ----------------------------------------------
        self.fifo = fifo = stream.SyncFIFO(layout, FIFO_DEPTH)
        self.sync += check.credit.eq(fifo.level < FIFO_DEPTH - check.latency - 2)
        self.comb += [
            check.source.connect(fifo.sink, omit={"ready"}),
            If(self.left_right,
                self.sink.ready.eq(votes),
                fifo.source.connect(self.source)
            ).Else(
                self.sink.connect(self.source)
            ),
        ]
        self.add_memory(columns, step, voting, votes)
        self.add_votes(step, voting, votes, wipe, pair)

    def add_memory(self, columns, step, voting, votes):
        """Winners on their way from the first pass to the second one."""
        memory = Memory(1 + len(self.sink.disparity), 2**(bits_for(columns - 1) + 1), name="left_right_winners")
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        read   = memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read
        self.comb += [
            write.adr.eq(Cat(step, voting)),
            write.dat_w.eq(Cat(self.sink.found, self.sink.disparity)),
            write.we.eq(votes & self.sink.valid),
            read.adr.eq(Cat(self.check.step, ~voting)),
            Cat(self.check.winner.found, self.check.winner.disparity).eq(read.dat_r),
        ]

    def add_votes(self, step, voting, votes, wipe, pair):
        """Votes to the one row, and what the second pass asks to the other one."""
        check   = self.check
        vote    = stream.Endpoint(self.rows[0].vote.description)
        rounded = Signal(len(self.sink.disparity) + 1)
        self.comb += rounded.eq(self.sink.disparity + 2**(DISPARITY_SHIFT - 1))
        self.sync += [
            vote.valid.eq(votes & self.sink.valid & (step != 0)),
            vote.column.eq(step + check.shift - rounded[DISPARITY_SHIFT:]),
            vote.found.eq(self.sink.found),
            vote.disparity.eq(self.sink.disparity),
            vote.cost.eq(self.sink.cost),
        ]
        for number, row in enumerate(self.rows):
            mine = voting == number
            self.comb += [
                row.voting.eq(mine & ~wipe),
                row.vote.valid.eq(vote.valid & mine),
                row.vote.payload.eq(vote.payload),
                row.clear.eq(wipe | check.clear),
                row.pair.eq(Mux(wipe, pair, check.pair)),
            ] + [look_up.eq(asked) for look_up, asked in zip(row.look_up, check.look_up)]
        for parity in range(2):
            self.comb += If(voting == 0,
                check.holds[parity].payload.eq(self.rows[1].holds[parity].payload)
            ).Else(
                check.holds[parity].payload.eq(self.rows[0].holds[parity].payload)
            )
