#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *

# Border -------------------------------------------------------------------------------------------

@ResetInserter()
class Border(LiteXModule):
    """Put the winners of the valid region into a frame of invalid pixels, in raster order.

    The valid region is cv2.StereoBM's: rows [k, height - k), columns [min_disparity + disparities - 1 + k, width - k)
    with k = block_size // 2. A pixel outside of it, or without a disparity, is invalid: its value is (min_disparity -
    1) pixels. A frame lasts from `begin` (one clock) to its last pixel; the settings must not change meanwhile.
    """
    def __init__(self, parameters):
        max_width, max_height = parameters.max_width, parameters.max_height
        self.sink    = stream.Endpoint(winner_layout(parameters)) # Winners of the valid region only.
        self.source  = stream.Endpoint(disparity_layout())        # Whole map.
        self.latency = None                                       # Adds the pixels of the border.

        self.width         = Signal(max=max_width + 1)                 # Columns of the frame.
        self.height        = Signal(max=max_height + 1)                # Rows of the frame.
        self.disparities   = Signal(max=parameters.disparities + 1)    # Disparities in use.
        self.min_disparity = Signal(max=MAX_MIN_DISPARITY + 1)         # Smallest disparity.
        self.block_size    = Signal(max=parameters.max_block_size + 1) # Side of the block.
        self.begin         = Signal()                                  # Start a frame (pulse).
        self.busy          = Signal()                                  # Between begin and the last pixel.

        # # #

        column, row, last, inside = self.add_position(parameters)

        # Map.
        # ----
        smallest = Signal(DISPARITY_BITS) # Of a winner, sixteenths of a pixel.
        invalid  = Signal(DISPARITY_BITS)
        self.sync += [
            smallest.eq(self.min_disparity << DISPARITY_SHIFT),
            invalid.eq(smallest - (1 << DISPARITY_SHIFT)),
        ]
        self.comb += [
            self.source.valid.eq(self.busy & (~inside | self.sink.valid)),
            self.source.first.eq((column == 0) & (row == 0)),
            self.source.last.eq(last),
            self.source.disparity.eq(Mux(inside & self.sink.found, smallest + self.sink.disparity, invalid)),
            self.sink.ready.eq(self.busy & inside & self.source.ready),
        ]

    def add_position(self, parameters):
        """Return column and row of the pixel, whether it is the last, and whether it is inside the valid region."""
        max_width, max_height = parameters.max_width, parameters.max_height
        # Edges of the valid region, registered: the settings are stable before the first comparison counts.
        margin       = self.block_size[1:]
        last_column  = Signal(max=max_width)
        last_row     = Signal(max=max_height)
        column_begin = Signal(max=parameters.disparities + MAX_MIN_DISPARITY + parameters.max_block_size)
        column_end   = Signal(max=max_width + 1)
        row_end      = Signal(max=max_height + 1)
        self.sync += [
            last_column.eq(self.width  - 1),
            last_row.eq(self.height - 1),
            column_begin.eq(self.min_disparity + self.disparities + margin - 1),
            column_end.eq(self.width  - margin),
            row_end.eq(self.height - margin),
        ]

        column    = Signal(max=max_width)
        row       = Signal(max=max_height)
        last      = Signal()
        valid_row = Signal()
        inside    = Signal()
        self.comb += [
            last.eq((column == last_column) & (row == last_row)),
            valid_row.eq((row >= margin) & (row < row_end)),
            inside.eq(valid_row & (column >= column_begin) & (column < column_end)),
        ]
        self.sync += [
            If(self.source.valid & self.source.ready,
                column.eq(column + 1),
                If(column == last_column,
                    column.eq(0),
                    row.eq(row + 1)
                ),
                If(last,
                    self.busy.eq(0)
                )
            ),
            If(self.begin,
                self.busy.eq(1),
                column.eq(0),
                row.eq(0)
            ),
        ]
        return column, row, last, inside
