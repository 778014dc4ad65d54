#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *

# Sort ------------------------------------------------------------------------------------------

def sort3(module, values):
    """Return three numbers sorted, smallest first, a clock later."""
    a, b, c = values
    ab      = Signal() # The first is not larger than the second.
    bc      = Signal()
    ac      = Signal()
    result  = [Signal.like(a) for _ in range(3)]
    module.comb += [
        ab.eq(a <= b),
        bc.eq(b <= c),
        ac.eq(a <= c),
    ]
    module.sync += [
        result[0].eq(Mux(ab & ac, a, Mux(~ab & bc, b, c))),
        result[1].eq(Mux(ab, Mux(bc, b, Mux(ac, c, a)), Mux(ac, a, Mux(bc, c, b)))),
        result[2].eq(Mux(ac & bc, c, Mux(ab & ~bc, b, a))),
    ]
    return result

# Median -------------------------------------------------------------------------------------------

FIFO_DEPTH      = 16
SIGN            = 1 << (DISPARITY_BITS - 1)
PIPELINE_CLOCKS = 2 + 1 + 2 # Pixels of a column, sorted, and the median of three of them.

@ResetInserter()
class Median(LiteXModule):
    """Median of each pixel of the map and its eight neighbours, as cv2.medianBlur(map, 3) has it, or the map as it is.

    Beyond the edges the outermost pixels repeat. A pixel without a disparity counts with its value, which is less than
    any disparity.

    A column of three pixels is sorted once and used for three medians. The median of nine pixels is the median of
    three: the largest of the columns' minima, the median of their medians, and the smallest of their maxima.

    A step of the raster takes pixel (row, column) and gives pixel (row - 1, column - 1), whose last neighbour it is. So
    there is a row more, and one step after that for its last pixel.
    """
    def __init__(self, parameters):
        self.sink    = stream.Endpoint(disparity_layout()) # Whole map.
        self.source  = stream.Endpoint(disparity_layout()) # Whole map.
        self.latency = None                                # Depends on the settings: none, or a row and a pixel.

        self.width  = Signal(max=parameters.max_width + 1)  # Columns of the frame.
        self.height = Signal(max=parameters.max_height + 1) # Rows of the frame.
        self.median = Signal()                              # Filter, or pass on.
        self.begin  = Signal()                              # Start a frame (pulse).
        self.busy   = Signal()                              # Between begin and the last pixel.

        # # #

        if "median" not in parameters.features:
            self.comb += self.sink.connect(self.source)
            return

        # Steps, the nine pixels of each, and their median, PIPELINE_CLOCKS later.
        # ------------------------------------------------------------------------
        self.credit = Signal()                               # One more result has room.
        self.column = Signal(max=parameters.max_width)       # Step: its column,
        self.row    = Signal(max=parameters.max_height + 2)  # and its row.
        self.ready  = Signal()                               # A pixel would be taken.
        issue, taking, end = self.add_steps(parameters)
        columns            = self.add_columns(issue, *self.add_rows(parameters, issue & taking))
        result             = self.add_median(columns)

        # Map: step (row, 0) gives the last pixel of the row before.
        # ----------------------------------------------------------
        gives = Signal()
        self.comb += gives.eq(issue & Mux(self.column == 0, self.row >= 2, self.row != 0))
        self.fifo = fifo = stream.SyncFIFO(disparity_layout(), FIFO_DEPTH)
        # Two more than the pipeline holds may be under way: the level and the credit are a clock late each.
        self.sync += self.credit.eq(fifo.level < FIFO_DEPTH - PIPELINE_CLOCKS - 2)
        self.comb += [
            fifo.sink.valid.eq(delayed(self, gives, PIPELINE_CLOCKS)),
            fifo.sink.first.eq(delayed(self, (self.row == 1) & (self.column == 1), PIPELINE_CLOCKS)),
            fifo.sink.last.eq(delayed(self, end, PIPELINE_CLOCKS)),
            fifo.sink.disparity.eq(result ^ SIGN),
            If(self.median,
                self.sink.ready.eq(self.ready),
                fifo.source.connect(self.source)
            ).Else(
                self.sink.connect(self.source)
            ),
        ]
        self.sync += [
            If(self.source.valid & self.source.ready & self.source.last,
                self.busy.eq(0)
            ),
            If(self.begin,
                self.busy.eq(self.median)
            ),
        ]

    def add_steps(self, parameters):
        """Return whether a step is made, whether its row takes pixels, and whether it is the last one."""
        column, row = self.column, self.row
        last_column = Signal(max=parameters.max_width)
        self.sync  += last_column.eq(self.width - 1)
        running = Signal()
        taking  = Signal()
        issue   = Signal()
        end     = Signal()
        self.comb += [
            taking.eq(row < self.height),
            end.eq(row > self.height),
            issue.eq(running & self.credit & (self.sink.valid | ~taking)),
            self.ready.eq(running & self.credit & taking),
        ]
        self.sync += [
            If(issue,
                column.eq(column + 1),
                If(column == last_column,
                    column.eq(0),
                    row.eq(row + 1)
                ),
                If(end,
                    running.eq(0)
                )
            ),
            If(self.begin,
                running.eq(self.median),
                column.eq(0),
                row.eq(0)
            ),
        ]
        return issue, taking, end

    def add_rows(self, parameters, takes):
        """Return three pixels of a column, at clock 2; rows beyond the edge repeat the outermost one.

        With its sign flipped a disparity compares as an unsigned number.
        """
        bits   = DISPARITY_BITS
        memory = Memory(2*bits, parameters.max_width, name="median_rows")
        read   = memory.get_port(mode=READ_FIRST)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        new                  = Signal(bits)
        above, middle, below = (Signal(bits) for _ in range(3))
        new_middle           = Signal(bits)
        first_row            = delayed(self, self.row == 1, 1)
        last_row             = delayed(self, self.row == self.height, 1)
        self.comb += read.adr.eq(self.column)
        self.sync += [
            new.eq(self.sink.disparity ^ SIGN),
            above.eq(Mux(first_row, read.dat_r[:bits], read.dat_r[bits:])),
            middle.eq(read.dat_r[:bits]),
            below.eq(Mux(last_row, read.dat_r[:bits], new)),
            new_middle.eq(new),
        ]
        self.comb += [
            write.adr.eq(delayed(self, self.column, 2)),
            write.dat_w.eq(Cat(new_middle, middle)),
            write.we.eq(delayed(self, takes, 2)),
        ]
        return above, middle, below

    def add_columns(self, issue, above, middle, below):
        """Return three sorted columns, at clock 3, the newest first; beyond the edge the outermost one repeats."""
        here      = sort3(self, [above, middle, below])
        valid     = delayed(self, issue, 3)
        left_edge = delayed(self, self.column == 1, 3)
        new_row   = delayed(self, self.column == 0, 3)
        before    = [Signal(DISPARITY_BITS) for _ in range(3)]
        further   = [Signal(DISPARITY_BITS) for _ in range(3)]
        self.sync += If(valid,
            [old.eq(young) for old, young in zip(before + further, here + before)]
        )
        newest = [Mux(new_row,   middle_column, near) for near, middle_column in zip(here, before)]
        oldest = [Mux(left_edge, middle_column, far)  for far,  middle_column in zip(further, before)]
        return newest, before, oldest

    def add_median(self, columns):
        """Return the median of three sorted columns, at clock 5."""
        newest, before, oldest = columns
        ranks = [sort3(self, list(rank)) for rank in zip(oldest, before, newest)]
        (_, _, low), (_, middle, _), (high, _, _) = ranks
        return sort3(self, [low, middle, high])[1]
