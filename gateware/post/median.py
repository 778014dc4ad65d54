#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *

# Sorting ------------------------------------------------------------------------------------------

def sort3(module, values):
    """Three numbers sorted, smallest first, a clock later."""
    a, b, c    = values
    ab, bc, ac = Signal(), Signal(), Signal() # The first is not larger than the second.
    result     = [Signal.like(a) for _ in range(3)]
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

FIFO_DEPTH = 16

@ResetInserter()
class Median(LiteXModule):
    """Median of each pixel of the map and its eight neighbours, as cv2.medianBlur(map, 3) has it, or the map as it is.

    Beyond the edges stand the outermost pixels again. A pixel without a disparity counts as its value, which is
    less than any disparity. Columns are sorted first, then the largest of the minima, the median of the
    medians and the smallest of the maxima: their median is that of all nine.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(disparity_layout()) # Whole map.
        self.source = stream.Endpoint(disparity_layout()) # Whole map.

        self.width  = Signal(max=parameters.max_width + 1)  # Columns of the frame.
        self.height = Signal(max=parameters.max_height + 1) # Rows of the frame.
        self.median = Signal()                              # Filter, or pass on.
        self.begin  = Signal()                              # Start a frame (pulse).
        self.busy   = Signal()                              # Between begin and the last pixel.

        # # #

        if "median" not in parameters.features:
            self.comb += self.sink.connect(self.source)
            return

        # Steps: one per pixel that comes in, one row more, and one for the last pixel of that.
        # --------------------------------------------------------------------------------------
        last_column = Signal(max=parameters.max_width)
        self.sync += last_column.eq(self.width - 1)
        self.latency = 5
        running = Signal()
        credit  = Signal()
        column  = Signal(max=parameters.max_width)
        row     = Signal(max=parameters.max_height + 2)
        taking  = Signal()
        issue   = Signal()
        taken   = Signal()
        end     = Signal()
        self.comb += [
            taking.eq(row < self.height),
            end.eq(row > self.height),
            issue.eq(running & credit & (self.sink.valid | ~taking)),
            taken.eq(running & credit & taking),
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

        # A column of three pixels, at clock 2; rows beyond the edge repeat the outermost one.
        # ------------------------------------------------------------------------------------
        # With its sign flipped a disparity compares as an unsigned number.
        bits   = DISPARITY_BITS
        memory = Memory(2*bits, parameters.max_width, name="median_rows")
        read   = memory.get_port(mode=READ_FIRST)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        new                  = Signal(bits)
        above, middle, below = (Signal(bits) for _ in range(3))
        new_middle           = Signal(bits)
        first_row            = delayed(self, row == 1, 1)
        last_row             = delayed(self, row == self.height, 1)
        self.comb += read.adr.eq(column)
        self.sync += [
            new.eq(self.sink.disparity ^ (1 << (bits - 1))),
            above.eq(Mux(first_row, read.dat_r[:bits], read.dat_r[bits:])),
            middle.eq(read.dat_r[:bits]),
            below.eq(Mux(last_row, read.dat_r[:bits], new)),
            new_middle.eq(new),
        ]
        self.comb += [
            write.adr.eq(delayed(self, column, 2)),
            write.dat_w.eq(Cat(new_middle, middle)),
            write.we.eq(delayed(self, issue & taking, 2)),
        ]

        # The columns to its left, at clock 3; those beyond the edge repeat the outermost one.
        # ------------------------------------------------------------------------------------
        here      = sort3(self, [above, middle, below])
        valid     = delayed(self, issue, 3)
        left_edge = delayed(self, column == 1, 3)
        new_row   = delayed(self, column == 0, 3)
        before    = [Signal(bits) for _ in range(3)]
        further   = [Signal(bits) for _ in range(3)]
        self.sync += If(valid,
            [old.eq(young) for old, young in zip(before + further, here + before)]
        )
        ranks = []
        for near, middle_column, far in zip(here, before, further):
            ranks.append(sort3(self, [Mux(left_edge, middle_column, far), middle_column,
                Mux(new_row, middle_column, near)]))
        (_, _, low), (_, mid, _), (high, _, _) = ranks
        result = sort3(self, [low, mid, high])[1]

        # Map.
        # ----
        # The step in column 0 gives the last pixel of the row before.
        gives = Signal()
        self.comb += gives.eq(issue & Mux(column == 0, row >= 2, row != 0))
        fifo = stream.SyncFIFO(disparity_layout(), FIFO_DEPTH)
        self.fifo = fifo
        self.sync += credit.eq(fifo.level < FIFO_DEPTH - self.latency - 2)
        self.comb += [
            fifo.sink.valid.eq(delayed(self, gives, self.latency)),
            fifo.sink.first.eq(delayed(self, (row == 1) & (column == 1), self.latency)),
            fifo.sink.last.eq(delayed(self, end, self.latency)),
            fifo.sink.disparity.eq(result ^ (1 << (bits - 1))),
            If(self.median,
                self.sink.ready.eq(taken),
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
