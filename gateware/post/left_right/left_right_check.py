#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *

# Left Right Check ---------------------------------------------------------------------------------

FLUSH_CLOCKS = 5

@ResetInserter()
class LeftRightCheck(LiteXModule):
    """Second pass of the left-right check over a row: look up the two columns that a winner leads to, and forget them.

    Winners of the row are read from a memory. A winner is refused if both columns, that of its disparity rounded down
    and that rounded up, hold a winner that differs by more than the limit.
    """
    def __init__(self, parameters):
        columns   = parameters.max_width
        layout    = winner_layout(parameters)
        disparity = dict(layout)["disparity"]
        depth     = (columns + 1)//2
        self.source     = stream.Endpoint(layout)     # Winners between `first_out` and `last_out`; no cost.
        self.credit     = Signal()                    # There is room for some more.
        self.start      = Signal()                    # Begin a row (pulse).
        self.idle       = Signal()                    # The row has ended.
        self.step       = Signal(max=columns)         # Winner that is read,
        self.winner     = stream.Endpoint(layout)     # and what it is, a clock later.
        self.look_up    = [Signal(max=depth, name="even"), Signal(max=depth, name="odd")] # Columns, halved.
        self.holds      = [stream.Endpoint(layout), stream.Endpoint(layout)] # Their winners, two clocks later.
        self.clear      = Signal()                    # Forget a pair of columns.
        self.pair       = Signal(max=depth)           # Its number.
        self.last       = Signal(max=columns)         # Last winner of the row.
        self.first_out  = Signal(max=columns)         # First winner that comes out,
        self.last_out   = Signal(max=columns)         # and last one.
        self.last_pair  = Signal(max=depth)           # Last pair of columns.
        self.shift      = Signal(max=columns)         # Column that the first winner leads to with disparity 0.
        self.difference = Signal(disparity)           # Largest difference, sixteenths of a pixel.
        self.latency    = 7                           # From step to source.

        # # #

        # Row.
        # ----
        issue = Signal()
        flush = Signal(max=FLUSH_CLOCKS + 1)
        tail  = Signal()
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
        # Behind the last winner there are columns that others have led to.
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
            If(tail_pair == self.last_pair,
                NextState("IDLE")
            )
        )

        # Columns, at clock 3.
        # --------------------
        step   = delayed(self, self.step, 3)
        valid  = delayed(self, issue, 3)
        winner = delayed(self, item_of(self.winner), 1)
        found, fraction, whole = winner[0], winner[1:1 + DISPARITY_SHIFT], winner[1 + DISPARITY_SHIFT:]
        down   = Signal(max=columns)
        up     = Signal(max=columns)
        used   = [Signal(), Signal()] # Which of the memories hold one of the two.
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

        # Columns that nobody can lead to any more.
        # -----------------------------------------
        self.comb += [
            self.clear.eq(tail | (valid & (step[1:] != 0))),
            self.pair.eq(Mux(tail, tail_pair, step[1:] - 1)),
        ]

        # Comparison, from clock 5 to clock 7.
        # ------------------------------------
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
            self.source.found.eq(delayed(self, found, 5) & ~(differs[0] & differs[1])),
            self.source.disparity.eq(delayed(self, own, 2)),
        ]

def item_of(endpoint):
    """Whether there is a disparity, and which."""
    return Cat(endpoint.found, endpoint.disparity)
