#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common        import *
from ..engines.costs import *

# Raster -------------------------------------------------------------------------------------------

@ResetInserter()
class Raster(LiteXModule):
    """Admit the pixel pairs of a frame and say what each step of the pipeline does.

    Behind this core nothing can stall: a step is made only when `credit` says that there is room for its result at
    the far end. That keeps the ready path of the whole matcher down to one register.

    A step stands for one pixel of the filtered image. It takes a pixel pair in as long as there are any in this row:
    with the prefilter the one below and to the right, so that there is a row and a column of steps more than pixels.
    The left-right check adds `outer` steps on both sides of the columns that have a whole block; there the left
    image, or the right one, or both stand still at their edge, as cv2.StereoBM has it.

    Position fields of the source:

    - ``take``: a pixel pair comes in, at ``column``.
    - ``pixel``: this step is a pixel of the filtered image, of its first or last column with ``pixel_first``,
      ``pixel_last``.
    - ``row_first``, ``row_last``: it is in the first, last row; ``row_flat``: in one that OpenCV does not filter.
    - ``row_old``: the row block_size above it exists: it leaves the sums.
    - ``move_left``, ``move_right``: the left, the right image moves on by a column; ``late``: the right one is
      delayed by `outer` columns more.
    - ``cost``: all disparities lie in the right image, in the ``cost_column``-th such column.
    - ``cost_first``: it is the first: sums along the row begin anew; ``cost_old``: the column block_size back
      exists: it leaves the sums.
    - ``complete``: the block that ends here lies inside both images, so it yields a winner.

    A frame runs from `begin` (one clock) until its last step has been made; the settings must not change
    meanwhile. The sink is not ready outside of a frame.
    """
    def __init__(self, parameters):
        ahead     = parameters.ahead
        max_slots = parameters.max_slots
        max_rows  = parameters.max_height + ahead
        self.sink   = stream.Endpoint(pixel_pair_layout())                               # Pixel pairs, raster order.
        self.source = stream.Endpoint(pixel_pair_layout() + position_layout(parameters)) # Pipeline: never stalls.

        self.width         = Signal(max=parameters.max_width + 1)      # Columns of the frame.
        self.height        = Signal(max=parameters.max_height + 1)     # Rows of the frame.
        self.disparities   = Signal(max=parameters.disparities + 1)    # Disparities in use.
        self.min_disparity = Signal(max=MAX_MIN_DISPARITY + 1)         # Smallest disparity.
        self.block_size    = Signal(max=parameters.max_block_size + 1) # Side of the block.
        self.outer         = Signal(max=max(parameters.outer, 1) + 1)  # Columns with a cost beside the valid region.
        self.begin         = Signal()                                  # Start a frame (pulse).
        self.credit        = Signal()                                  # One more result has room.
        self.latency       = 2

        # # #

        # Thresholds, registered: the settings are stable long before the first comparison counts.
        # -----------------------------------------------------------------------------------------
        # Slots are numbered from 0, so the pixel of slot s is in column s - ahead.
        def threshold(value, most):
            signal = Signal(max=most + 1)
            self.sync += signal.eq(value)
            return signal

        most         = max_slots + MAX_MIN_DISPARITY + MAX_DISPARITIES
        take_last    = threshold(self.width  - 1, max_slots)
        row_take     = threshold(self.height - 1, max_rows)
        slot_last    = threshold(self.width  + 2*self.outer - (1 - ahead), max_slots)
        row_last     = threshold(self.height - (1 - ahead), max_rows)
        pixel_last   = threshold(self.width  - (1 - ahead), max_slots)
        left_last    = threshold(self.width  + self.outer - (1 - ahead), max_slots)
        right_last   = threshold(left_last   + self.min_disparity, most)
        cost_first   = threshold(self.disparities + self.min_disparity + ahead - 1, most)
        hold_last    = threshold(cost_first + self.outer, most)
        cost_old     = threshold(cost_first + self.block_size, most)
        complete     = threshold(cost_first + self.block_size - 1, most)
        row_old      = threshold(self.block_size + ahead, max_rows)
        row_complete = threshold(self.block_size - (1 - ahead), max_rows)

        # Steps.
        # ------
        running    = Signal()
        row_in     = Signal() # This row takes pixel pairs in,
        column_in  = Signal() # and so does this slot.
        slot       = Signal(max=max_slots + 1)
        row        = Signal(max=max_rows + 1)
        take, step = Signal(), Signal()
        self.comb += [
            take.eq(row_in & column_in),
            self.sink.ready.eq(running & self.credit & take),
            step.eq(running & self.credit & (self.sink.valid | ~take)),
        ]
        self.sync += [
            If(step,
                slot.eq(slot + 1),
                If(slot == take_last,
                    column_in.eq(0)
                ),
                If(slot == slot_last,
                    slot.eq(0),
                    column_in.eq(1),
                    row.eq(row + 1),
                    If(row == row_take,
                        row_in.eq(0)
                    ),
                    If(row == row_last,
                        running.eq(0)
                    )
                )
            ),
            If(self.begin,
                running.eq(1),
                slot.eq(0),
                row.eq(0),
                row_in.eq(1),
                column_in.eq(1)
            ),
        ]

        # Registers in front of and behind the comparisons.
        # -------------------------------------------------
        now = stream.Endpoint(pixel_pair_layout() + [("slot", len(slot)), ("row", len(row)), ("take", 1)])
        self.sync += [
            now.valid.eq(step),
            now.left.eq(self.sink.left),
            now.right.eq(self.sink.right),
            now.slot.eq(slot),
            now.row.eq(row),
            now.take.eq(take),
        ]
        in_image    = Signal()
        cost_column = Signal(max=most + 1)
        self.comb += [
            in_image.eq((now.row >= ahead) & (now.slot >= ahead)),
            cost_column.eq(now.slot - cost_first),
        ]
        source = self.source
        self.sync += [
            source.valid.eq(now.valid),
            source.left.eq(now.left),
            source.right.eq(now.right),
            source.column.eq(now.slot),
            source.take.eq(now.take),
            source.pixel.eq(in_image & (now.slot <= pixel_last)),
            source.pixel_first.eq(now.slot == ahead),
            source.pixel_last.eq(now.slot == pixel_last),
            source.row_first.eq(now.row == ahead),
            source.row_last.eq(now.row == row_last),
            source.row_flat.eq((now.row == row_last) & self.height[0]),
            source.row_old.eq(now.row >= row_old),
            source.late.eq(now.slot > cost_first),
            source.move_left.eq(now.slot <= left_last),
            source.move_right.eq(((now.slot <= cost_first) | (now.slot > hold_last)) & (now.slot <= right_last)),
            source.cost.eq((now.row >= ahead) & (now.slot >= cost_first)),
            source.cost_column.eq(cost_column),
            source.cost_first.eq(now.slot == cost_first),
            source.cost_old.eq(now.slot >= cost_old),
            source.complete.eq((now.row >= row_complete) & (now.slot >= complete)),
        ]
