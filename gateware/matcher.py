#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common              import *
from .absolute_difference import AbsoluteDifference
from .block_sum           import BlockSum
from .border              import Border
from .column_sum          import ColumnSum
from .line_buffer         import LineBuffer
from .raster              import Raster
from .winner              import Winner

# Matcher ------------------------------------------------------------------------------------------

@ResetInserter()
class Matcher(LiteXModule):
    """SAD block matcher: a stream of pixel pairs in, a disparity map out, one pixel per clock.

    All disparities are computed in parallel. Between admission (`Raster`) and the winners' FIFO nothing stalls; the FIFO
    has room for every result that is under way.

    A frame begins with the first pixel pair that is valid while the matcher is idle and ends when the last pixel of the
    map has left. Settings are taken over at its begin and stay until its end. They must be legal: disparities a multiple of
    16, block_size odd, width and height at least disparities + block_size - 1 and block_size.

    Parameters
    ----------
    max_width : int
        Widest frame in pixels.
    max_height : int
        Highest frame in pixels. Costs only counter bits.
    disparities : int
        Largest number of disparities, a multiple of 16 from 16 to 128.
    max_block_size : int
        Largest side of the block, odd, from 5 to 31.
    """
    def __init__(self, max_width=640, max_height=4095, disparities=64, max_block_size=9):
        check_matcher_parameters(max_width, disparities, max_block_size)
        self.sink   = stream.Endpoint(pixel_pair_layout()) # Rectified pixel pairs, width x height of them a frame.
        self.source = stream.Endpoint(disparity_layout())  # Disparity map, width x height pixels a frame.

        self.width       = Signal(max=max_width + 1,      reset=max_width)      # Columns of the next frame.
        self.height      = Signal(max=max_height + 1,     reset=max_height)     # Rows of the next frame.
        self.disparities = Signal(max=disparities + 1,    reset=disparities)    # Disparities to search.
        self.block_size  = Signal(max=max_block_size + 1, reset=max_block_size) # Side of the block.
        self.busy        = Signal()                                             # A frame is under way.
        self.first_row   = Signal()                                             # First row with disparities out (pulse).
        self.latency     = None # Depends on the settings: a row is out block_size//2 rows after its pixels came in.

        # # #

        # Cores.
        # ------
        image = dict(max_width=max_width, max_height=max_height, disparities=disparities, max_block_size=max_block_size)
        lanes = dict(max_width=max_width, disparities=disparities, max_block_size=max_block_size)
        self.raster      = Raster(**image)
        self.line_buffer = LineBuffer(max_width=max_width, max_block_size=max_block_size)
        self.difference  = AbsoluteDifference(max_width=max_width, disparities=disparities)
        self.column_sum  = ColumnSum(**lanes)
        self.block_sum   = BlockSum(**lanes)
        self.winner      = Winner(**lanes)
        self.border      = Border(**image)

        # Settings: held for the whole frame.
        # -----------------------------------
        begin = Signal()
        wait  = Signal(2)
        for name in ["width", "height", "disparities", "block_size"]:
            setting = getattr(self, name)
            held    = Signal.like(setting)
            self.sync += If(begin, held.eq(setting))
            for core in [self.raster, self.line_buffer, self.block_sum, self.winner, self.border]:
                if hasattr(core, name):
                    self.comb += getattr(core, name).eq(held)

        # Frame: settings first, then, when the thresholds derived from them are registered, the pixels.
        # ----------------------------------------------------------------------------------------------
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            If(self.sink.valid,
                begin.eq(1),
                NextValue(wait, 2),
                NextState("SETTLE")
            )
        )
        fsm.act("SETTLE",
            self.busy.eq(1),
            NextValue(wait, wait - 1),
            If(wait == 0,
                self.raster.begin.eq(1),
                self.border.begin.eq(1),
                NextState("BEGIN")
            )
        )
        fsm.act("BEGIN",
            self.busy.eq(1),
            NextState("FRAME")
        )
        fsm.act("FRAME",
            self.busy.eq(1),
            If(~self.border.busy,
                NextState("IDLE")
            )
        )

        # Pipeline.
        # ---------
        self.comb += [
            self.sink.connect(self.raster.sink),
            self.raster.source.connect(self.line_buffer.sink),
            self.line_buffer.source.connect(self.difference.sink),
            self.difference.source.connect(self.column_sum.sink),
            self.column_sum.source.connect(self.block_sum.sink),
            self.block_sum.source.connect(self.winner.sink),
        ]

        # Winners' FIFO, and credit for as many results as it holds.
        # ----------------------------------------------------------
        pipeline   = [self.raster, self.line_buffer, self.difference, self.column_sum, self.block_sum, self.winner]
        depth      = 2**bits_for(sum(core.latency for core in pipeline) + 4)
        self.fifo  = fifo = stream.SyncFIFO(disparity_layout(), depth=depth)
        used       = Signal(max=depth + 1)
        give, take = Signal(), Signal()
        self.comb += [
            # A pixel that turns out to complete no block gives its credit back behind the raster.
            give.eq((fifo.source.valid & fifo.source.ready)),
            take.eq(self.raster.source.valid & self.raster.source.complete),
        ]
        # One pixel may be between admission and the count: stop one early.
        self.sync += [
            used.eq(used + take - give),
            self.raster.credit.eq(used < depth - 3),
        ]
        self.comb += [
            fifo.sink.valid.eq(self.winner.source.valid),
            fifo.sink.disparity[DISPARITY_SHIFT:].eq(self.winner.source.index),
            fifo.source.connect(self.border.sink),
            self.border.source.connect(self.source),
            self.first_row.eq(self.border.first_row),
        ]
