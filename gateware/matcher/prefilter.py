#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common        import *
from ..engines.costs import *

# Prefilter ----------------------------------------------------------------------------------------

@ResetInserter()
class Prefilter(LiteXModule):
    """Horizontal 3x3 Sobel filter, clipped to +-cap and shifted to 0 to 2*cap; or the grey values as they are.

    It is cv2.StereoBM's PREFILTER_XSOBEL: the second row also counts as the one above the first, the last but one also
    as the one below the last. The first and the last column are cap, and so is the last row if the number of rows is
    odd.

    The pixel that comes in is one row below and one column to the right of the one that goes out; two rows wait in a
    memory. A core that is built without the filter only passes pixels on.
    """
    def __init__(self, parameters):
        bits = parameters.filtered_bits
        self.sink   = stream.Endpoint(pixel_pair_layout() + position_layout(parameters))     # Pipeline.
        self.source = stream.Endpoint(pixel_pair_layout(bits) + position_layout(parameters)) # Pipeline.

        self.width  = Signal(max=parameters.max_width + 1)  # Columns of the frame.
        self.xsobel = Signal()                              # Filter, or pass on.
        self.cap    = Signal(max=MAX_PREFILTER_CAP + 1)     # Largest slope that is kept.

        # # #

        if "xsobel" in parameters.features:
            self.latency = 2 + 3 + 2 # Memory and its register, slope, clip.
            self.add_filter(parameters)
        else:
            self.latency = 0
            self.comb += connect_pipeline(self.sink, self.source)

    def add_filter(self, parameters):
        """Filter both images: three rows from memory at clock 2, their slope at clock 5, clipped at clock 7."""
        stages = pass_position(self, self.sink, self.source, self.latency)

        # Memory of the two rows above, a word of both images and both rows per column.
        # -----------------------------------------------------------------------------
        pair_bits = 2*PIXEL_BITS
        memory    = Memory(2*pair_bits, parameters.max_width, name="prefilter_rows")
        read      = memory.get_port(mode=READ_FIRST)
        write     = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        pair     = Signal(pair_bits) # Row that comes in, at clock 1,
        new_pair = Signal(pair_bits) # and at clock 2.
        middle   = Signal(pair_bits) # Row that goes out, at clock 2,
        above    = Signal(pair_bits) # and the one above it.
        self.comb += read.adr.eq(self.sink.column)
        self.sync += [
            pair.eq(Cat(self.sink.left, self.sink.right)),
            new_pair.eq(pair),
            middle.eq(read.dat_r[:pair_bits]),
            above.eq(read.dat_r[pair_bits:]),
        ]
        self.comb += [
            write.adr.eq(stages[2].column),
            write.dat_w.eq(Cat(new_pair, middle)),
            write.we.eq(stages[2].valid & stages[2].take),
        ]

        # A filter for each image.
        # ------------------------
        edge = Signal() # This pixel is not filtered.
        last = stages[self.latency - 1]
        self.comb += edge.eq(last.pixel_first | last.pixel_last | last.row_flat)
        for side in range(2):
            part = slice(side*PIXEL_BITS, (side + 1)*PIXEL_BITS)
            raw, slope = self.add_slope(stages, new_pair[part], middle[part], above[part])
            output     = (self.source.left, self.source.right)[side]
            self.add_clip(raw, slope, edge, output)

    def add_slope(self, stages, below, middle, above):
        """Return raw pixel and slope (11 bits, signed) at clock 5, from the three rows at clock 2."""
        # Rows beyond the edge, then the weighted sum of all three, at clock 4.
        outer_rows = Signal(PIXEL_BITS + 1)
        inner_row  = Signal(PIXEL_BITS)
        smooth     = Signal(PIXEL_BITS + 2)
        self.sync += [
            outer_rows.eq(Mux(stages[2].row_last, above, below) + Mux(stages[2].row_first, below, above)),
            inner_row.eq(middle),
            smooth.eq(outer_rows + (inner_row << 1)),
        ]
        # The two columns before, kept until a new one comes.
        before, middle_column, pixel = Signal.like(smooth), Signal.like(smooth), Signal(PIXEL_BITS)
        raw                          = Signal(PIXEL_BITS)
        slope                        = Signal((PIXEL_BITS + 3, True))
        newest                       = delayed(self, inner_row, 1)
        self.sync += [
            If(stages[4].valid,
                middle_column.eq(smooth),
                before.eq(middle_column),
                pixel.eq(newest)
            ),
            slope.eq(smooth - before),
            raw.eq(pixel),
        ]
        return raw, slope

    def add_clip(self, raw, slope, edge, output):
        """Clip and shift, from clock 5 to clock 7."""
        shifted = Signal((PIXEL_BITS + 4, True))
        ceiling = Signal(len(output))
        grey    = delayed(self, raw, 1)
        result  = Signal(len(output))
        above   = Signal()
        excess  = Signal((PIXEL_BITS + 5, True))
        self.comb += [
            excess.eq(shifted - ceiling),
            above.eq(~excess[-1]),
        ]
        self.sync += [
            ceiling.eq(self.cap << 1),
            shifted.eq(slope + self.cap),
            If(edge,
                result.eq(self.cap)
            ).Elif(shifted[-1],
                result.eq(0)
            ).Elif(above,
                result.eq(ceiling)
            ).Else(
                result.eq(shifted)
            ),
            If(~self.xsobel,
                result.eq(grey)
            ),
        ]
        self.comb += output.eq(result)
