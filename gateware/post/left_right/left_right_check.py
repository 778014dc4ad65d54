#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Left Right Check ---------------------------------------------------------------------------------

LOOK_UP_CLOCKS = 3 # A winner from memory, its register, the columns that it leads to.
ANSWER_CLOCKS  = 2 # Memory of `VoteRow`, its register.
COMPARE_CLOCKS = 2 # Difference, whether it is too large.

# From the last winner of a row until its columns have been answered: only then may the rows swap.
FLUSH_CLOCKS = LOOK_UP_CLOCKS + ANSWER_CLOCKS

@ResetInserter()
class LeftRightCheck(LiteXModule):
    """Second pass of the left-right check over a row: look up the two columns that each winner leads to, then forget
    them.

    Winners of the row are read from a memory. A winner leads to the column of its disparity rounded down and to that of
    its disparity rounded up. It is refused if both columns hold a winner that differs by more than the limit.

    For example, with `shift` 15 the winner of step 20 and disparity 2.5 leads to columns 20 + 15 - 2 = 33 and 32.
    Columns are numbered from the right image's first one, and two neighbours, 2*n and 2*n + 1, are column pair n.
    """
    def __init__(self, parameters):
        columns   = parameters.max_width
        layout    = winner_layout(parameters)
        disparity = dict(layout)["disparity"]
        depth     = (columns + 1)//2
        self.source      = stream.Endpoint(layout) # Winners from `first_out` to `last_out`; no cost.
        self.credit      = Signal()                # There is room for some more.
        self.start       = Signal()                # Begin a row (pulse).
        self.idle        = Signal()                # The row has ended.
        self.step        = Signal(max=columns)     # Winner that is read,
        self.winner      = stream.Endpoint(layout) # and what it is, a clock later.
        self.look_up     = [Signal(max=depth, name="even"), Signal(max=depth, name="odd")] # Columns, halved.
        self.holds       = [stream.Endpoint(layout), stream.Endpoint(layout)] # Their winners, two clocks later.
        self.clear       = Signal()                # Forget a column pair.
        self.column_pair = Signal(max=depth)       # Its number.
        self.latency     = LOOK_UP_CLOCKS + ANSWER_CLOCKS + COMPARE_CLOCKS # From step to source.

        # Thresholds: see `add_thresholds`.
        self.last             = Signal(max=columns) # Last winner of the row.
        self.first_out        = Signal(max=columns) # First winner that comes out,
        self.last_out         = Signal(max=columns) # and last one.
        self.last_column_pair = Signal(max=depth)   # Last column pair.
        self.shift            = Signal(max=columns) # Column that the first winner leads to with disparity 0.
        self.difference       = Signal(disparity)   # Largest difference, sixteenths of a pixel.

        # # #

        issue, tail, tail_pair = self.add_row(depth)

        # Clock 3 of a step: its winner is there, and the columns that it leads to.
        step   = delayed(self, self.step, 3)
        valid  = delayed(self, issue, 3)
        winner = delayed(self, item_of(self.winner), 1)
        used   = self.add_look_up(columns, winner)
        # Columns that no later winner can lead to.
        self.comb += [
            self.clear.eq(tail | (valid & (step[1:] != 0))),
            self.column_pair.eq(Mux(tail, tail_pair, step[1:] - 1)),
        ]
        self.add_comparison(disparity, step, valid, winner, used)

    def add_thresholds(self, last, last_right, outer, disparities, disp12_max_diff):
        """Derive the thresholds from the settings of a frame, a register each.

        Parameters
        ----------
        last, last_right : Signal
            Last winner of a row, and last column of the right image that one can lead to.
        outer, disparities, disp12_max_diff : Signal
            Settings, as those of `LeftRight`.
        """
        largest = Signal(bits_for(MAX_DISP12_MAX_DIFF) + DISPARITY_SHIFT)
        ceiling = 2**len(self.difference) - 1
        self.sync += [
            largest.eq(disp12_max_diff << DISPARITY_SHIFT),
            self.difference.eq(Mux(largest > ceiling, ceiling, largest)),
            self.last.eq(last),
            self.first_out.eq(outer),
            self.last_out.eq(last - outer),
            self.last_column_pair.eq(last_right[1:]),
            self.shift.eq(disparities - 1),
        ]

    def add_row(self, depth):
        """Step through the winners of a row, then forget the columns that are left over.

        Return whether a step is made, whether a column pair after the last step is forgotten, and which.
        """
        issue     = Signal()
        flush     = Signal(max=FLUSH_CLOCKS + 1)
        tail      = Signal()
        tail_pair = Signal(max=depth)
        self.fsm  = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            self.idle.eq(1),
            NextValue(self.step, 0),
            NextValue(flush, 0),
            If(self.start,
                NextState("CHECK")
            )
        )
        fsm.act("CHECK",
            issue.eq(self.credit),
            If(issue,
                NextValue(self.step, self.step + 1),
                If(self.step == self.last,
                    NextState("FLUSH")
                )
            )
        )
        # Beyond the last winner there are columns that others have led to.
        fsm.act("FLUSH",
            NextValue(flush, flush + 1),
            NextValue(tail_pair, self.last[1:]),
            If(flush == FLUSH_CLOCKS - 1,
                NextState("CLEAR")
            )
        )
        fsm.act("CLEAR",
            tail.eq(1),
            NextValue(tail_pair, tail_pair + 1),
            If(tail_pair == self.last_column_pair,
                NextState("IDLE")
            )
        )
        return issue, tail, tail_pair

    def add_look_up(self, columns, winner):
        """Ask for both columns of a winner, from clock 2 to clock 3; return which memories hold one of them."""
        fraction, whole = winner[1:1 + DISPARITY_SHIFT], winner[1 + DISPARITY_SHIFT:]
        down = Signal(max=columns)
        up   = Signal(max=columns)
        used = [Signal(), Signal()] # Even and odd columns.
        self.comb += [
            down.eq(delayed(self, self.step, 2) + self.shift - whole),
            up.eq(down - (fraction != 0)),
        ]
        for parity in range(2):
            this = down[0] == parity
            self.sync += [
                self.look_up[parity].eq(Mux(this, down[1:], up[1:])),
                used[parity].eq(this | (fraction != 0)),
            ]
        return used

    def add_comparison(self, disparity, step, valid, winner, used):
        """Compare a winner with those of its columns, from clock 5 to clock 7."""
        own     = delayed(self, winner[1:], 3)
        differs = []
        for parity in range(2):
            gap       = Signal((disparity + 1, True))
            magnitude = Signal(disparity)
            voted     = Signal()
            far       = Signal()
            self.sync += [
                gap.eq(self.holds[parity].disparity - own),
                voted.eq(self.holds[parity].found),
                far.eq((voted & (magnitude > self.difference)) | ~delayed(self, used[parity], 3)),
            ]
            self.comb += magnitude.eq((gap[:disparity] ^ Replicate(gap[-1], disparity)) + gap[-1])
            differs.append(far)
        inside = (step >= self.first_out) & (step <= self.last_out)
        self.comb += [
            self.source.valid.eq(delayed(self, valid & inside, 4)),
            self.source.found.eq(delayed(self, winner[0], 5) & ~(differs[0] & differs[1])),
            self.source.disparity.eq(delayed(self, own, 2)),
        ]

def item_of(endpoint):
    """Return whether there is a disparity, and which, as one number."""
    return Cat(endpoint.found, endpoint.disparity)
