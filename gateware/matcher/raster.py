#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from types import SimpleNamespace

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common        import *
from ..engines.costs import *

# Raster -------------------------------------------------------------------------------------------

@ResetInserter()
class Raster(LiteXModule):
    """Admit the pixel pairs of a frame and say what each step of the pipeline does.

    After this core nothing can stall: a step is made only when `credit` says that there is room for its result at the
    far end. That keeps the ready path of the whole matcher down to one register.

    A step is one pixel of the filtered image. It takes a pixel pair while its row has any left. With the prefilter that
    is the pair one row below and one column to the right, so that there is a row and a column of steps more than of
    pixels. This is a frame of 5 x 4 pixels: each step with its number, the row and column of the pair that it takes,
    and the row and column of the pixel that it is.

        step_index  0          1          2          3          4          5
        row 0      0 00/--    1 01/--    2 02/--    3 03/--    4 04/--    5 --/--
        row 1      6 10/--    7 11/00    8 12/01    9 13/02   10 14/03   11 --/04
        row 2     12 20/--   13 21/10   14 22/11   15 23/12   16 24/13   17 --/14
        row 3     18 30/--   19 31/20   20 32/21   21 33/22   22 34/23   23 --/24
        row 4     24 --/--   25 --/30   26 --/31   27 --/32   28 --/33   29 --/34

    With block_size 3 and, for the example, 2 disparities from 0 up: a cost needs column 1 of the left image, the first
    one for which both disparities lie in the right image. So steps with step_index 2 to 5 of rows 1 to 4 have a cost,
    in cost columns 0 to 3. The first block is complete where its third row and its third cost column meet, in step 22.

    The left-right check adds `outer` steps on both sides of the columns that have a whole block. There the left image,
    the right one or both are held at their edge, as cv2.StereoBM has it.

    The source has the fields of `position_layout`:

    - Step: ``column`` is the step_index; ``take``: a pixel pair comes in, of that column.
    - Pixel: ``pixel``: the step is a pixel of the filtered image, of its first or last column with ``pixel_first``,
      ``pixel_last``, of its first or last row with ``row_first``, ``row_last``; ``row_flat``: of a row that OpenCV does
      not filter; ``row_old``: the row block_size above it exists, so it leaves the sums.
    - Cost, which pixels meet: ``move_left``, ``move_right``: the left, the right image moves on by a column; ``late``:
      the right one is delayed by `outer` columns more.
    - Cost, which sums: ``cost``: all disparities lie in the right image, in the ``cost_column``-th such column;
      ``cost_first``: it is the first: sums along the row begin anew; ``cost_old``: the column block_size back exists,
      so it leaves the sums; ``complete``: the block that ends here lies inside both images, so it yields a winner.

    A frame lasts from `begin` (one clock) until its last step has been made; the settings must not change meanwhile.
    The sink is not ready outside of a frame.
    """
    def __init__(self, parameters):
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
        self.latency       = 2                                         # Registers before and after the comparisons.

        # # #

        self.add_thresholds(parameters)
        self.add_position(parameters.ahead, self.add_steps())

    def add_thresholds(self, parameters):
        """Register what steps and rows are compared with: settings are stable before the first comparison counts.

        Steps of a row and rows are numbered from 0, so step s is the pixel of column s - ahead. All are attributes of
        `thresholds`.
        """
        ahead     = parameters.ahead
        max_steps = parameters.max_slots
        max_rows  = parameters.max_height + ahead
        most      = max_steps + MAX_MIN_DISPARITY + MAX_DISPARITIES
        self.thresholds = thresholds = SimpleNamespace()

        def add(name, value, largest):
            threshold = Signal(max=largest + 1, name=name)
            self.sync += threshold.eq(value)
            setattr(thresholds, name, threshold)

        # Pairs that are taken, steps, pixels.
        add("take_last",      self.width  - 1,                             max_steps)
        add("take_last_row",  self.height - 1,                             max_rows)
        add("step_last",      self.width  + 2*self.outer - (1 - ahead),    max_steps)
        add("row_last",       self.height - (1 - ahead),                   max_rows)
        add("pixel_last",     self.width  - (1 - ahead),                   max_steps)
        # Images that move on: the left one up to its last column, the right one but for `outer` steps at its first one.
        add("left_last",      self.width  + self.outer - (1 - ahead),      max_steps)
        add("right_last",     thresholds.left_last  + self.min_disparity,  most)
        add("cost_first",     self.disparities + self.min_disparity + ahead - 1, most)
        add("hold_last",      thresholds.cost_first + self.outer,          most)
        # Sums, and blocks that are complete.
        add("cost_old",       thresholds.cost_first + self.block_size,     most)
        add("complete",       thresholds.cost_first + self.block_size - 1, most)
        add("row_old",        self.block_size + ahead,                     max_rows)
        add("row_complete",   self.block_size - (1 - ahead),               max_rows)

    def add_steps(self):
        """Step through the frame; return the step: a pair, its step_index and row, and whether the pair was taken."""
        thresholds   = self.thresholds
        step_index   = Signal.like(thresholds.step_last)
        row          = Signal.like(thresholds.row_last)
        running      = Signal()
        row_takes    = Signal() # This row takes pixel pairs,
        column_takes = Signal() # and so does this step of it.
        take, step   = Signal(), Signal()
        self.comb += [
            take.eq(row_takes & column_takes),
            self.sink.ready.eq(running & self.credit & take),
            step.eq(running & self.credit & (self.sink.valid | ~take)),
        ]
        self.sync += [
            If(step,
                step_index.eq(step_index + 1),
                If(step_index == thresholds.take_last,
                    column_takes.eq(0)
                ),
                If(step_index == thresholds.step_last,
                    step_index.eq(0),
                    column_takes.eq(1),
                    row.eq(row + 1),
                    If(row == thresholds.take_last_row,
                        row_takes.eq(0)
                    ),
                    If(row == thresholds.row_last,
                        running.eq(0)
                    )
                )
            ),
            If(self.begin,
                running.eq(1),
                step_index.eq(0),
                row.eq(0),
                row_takes.eq(1),
                column_takes.eq(1)
            ),
        ]
        # A register before the comparisons.
        now = stream.Endpoint(pixel_pair_layout() + [("step_index", len(step_index)), ("row", len(row)), ("take", 1)])
        self.sync += [
            now.valid.eq(step),
            now.left.eq(self.sink.left),
            now.right.eq(self.sink.right),
            now.step_index.eq(step_index),
            now.row.eq(row),
            now.take.eq(take),
        ]
        return now

    def add_position(self, ahead, now):
        """Compare a step with the thresholds, with a register after the comparisons."""
        source, thresholds = self.source, self.thresholds
        step, row          = now.step_index, now.row
        in_image           = Signal()
        cost_column        = Signal.like(thresholds.cost_first)
        self.comb += [
            in_image.eq((row >= ahead) & (step >= ahead)),
            cost_column.eq(step - thresholds.cost_first),
        ]
        self.sync += [
            source.valid.eq(now.valid),
            source.left.eq(now.left),
            source.right.eq(now.right),
            # Step.
            source.column.eq(step),
            source.take.eq(now.take),
            # Pixel.
            source.pixel.eq(in_image & (step <= thresholds.pixel_last)),
            source.pixel_first.eq(step == ahead),
            source.pixel_last.eq(step == thresholds.pixel_last),
            source.row_first.eq(row == ahead),
            source.row_last.eq(row == thresholds.row_last),
            source.row_flat.eq((row == thresholds.row_last) & self.height[0]),
            source.row_old.eq(row >= thresholds.row_old),
            # Cost.
            source.late.eq(step > thresholds.cost_first),
            source.move_left.eq(step <= thresholds.left_last),
            source.move_right.eq(((step <= thresholds.cost_first) | (step > thresholds.hold_last))
                & (step <= thresholds.right_last)),
            source.cost.eq((row >= ahead) & (step >= thresholds.cost_first)),
            source.cost_column.eq(cost_column),
            source.cost_first.eq(step == thresholds.cost_first),
            source.cost_old.eq(step >= thresholds.cost_old),
            source.complete.eq((row >= thresholds.row_complete) & (step >= thresholds.complete)),
        ]
