#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common import *

# Raster -------------------------------------------------------------------------------------------

@ResetInserter()
class Raster(LiteXModule):
    """Admit the pixel pairs of a frame and say where each of them stands.

    Behind this core nothing can stall: a pixel pair is admitted only when `credit` says that there is room
    for its result at the far end. That keeps the ready path of the whole matcher down to one register.

    Position fields of the source, all seen from the block whose lower right corner the pixel is:

    - ``column``: column of the pixel, from 0.
    - ``row_first``, ``column_first``: the pixel is in row 0, column 0: sums begin anew.
    - ``row_old``, ``column_old``: row - block_size, column - block_size exist: they leave the sums.
    - ``complete``: the block lies inside both images for all disparities, so it yields a winner.

    A frame runs from `begin` (one clock) until its last pixel has been admitted; the settings must not change
    meanwhile. The sink is not ready outside of a frame.
    """
    def __init__(self, max_width=640, max_height=4095, disparities=64, max_block_size=9):
        check_matcher_parameters(max_width, disparities, max_block_size)
        self.sink   = stream.Endpoint(pixel_pair_layout())                              # Pixel pairs, raster order.
        self.source = stream.Endpoint(pixel_pair_layout() + position_layout(max_width)) # Pipeline: never stalls.

        self.width       = Signal(max=max_width + 1)      # Columns of the frame.
        self.height      = Signal(max=max_height + 1)     # Rows of the frame.
        self.disparities = Signal(max=disparities + 1)    # Disparities in use.
        self.block_size  = Signal(max=max_block_size + 1) # Side of the block.
        self.begin       = Signal()                       # Start a frame (pulse).
        self.credit      = Signal()                       # One more result has room.
        self.latency     = 1

        # # #

        # Thresholds, registered: the settings are stable long before the first comparison counts.
        # -----------------------------------------------------------------------------------------
        last_column    = Signal(max=max_width)
        last_row       = Signal(max=max_height)
        block_last     = Signal(max=max_block_size + 1)
        first_complete = Signal(max=disparities + max_block_size)
        self.sync += [
            last_column.eq(self.width  - 1),
            last_row.eq(self.height - 1),
            block_last.eq(self.block_size - 1),
            first_complete.eq(self.disparities + self.block_size - 2),
        ]

        # Position.
        # ---------
        running = Signal()
        column  = Signal(max=max_width)
        row     = Signal(max=max_height)
        admit   = Signal()
        self.comb += [
            self.sink.ready.eq(running & self.credit),
            admit.eq(self.sink.valid & self.sink.ready),
        ]
        self.sync += [
            If(admit,
                column.eq(column + 1),
                If(column == last_column,
                    column.eq(0),
                    row.eq(row + 1),
                    If(row == last_row,
                        running.eq(0)
                    )
                )
            ),
            If(self.begin,
                running.eq(1),
                column.eq(0),
                row.eq(0)
            ),
        ]

        # Output register.
        # ----------------
        self.sync += [
            self.source.valid.eq(admit),
            self.source.left.eq(self.sink.left),
            self.source.right.eq(self.sink.right),
            self.source.column.eq(column),
            self.source.row_first.eq(row == 0),
            self.source.row_old.eq(row > block_last),
            self.source.column_first.eq(column == 0),
            self.source.column_old.eq(column > block_last),
            self.source.complete.eq((row >= block_last) & (column >= first_complete)),
        ]
