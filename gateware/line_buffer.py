#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common import *

# Line Buffer --------------------------------------------------------------------------------------

@ResetInserter()
class LineBuffer(LiteXModule):
    """Add to each pixel pair the pair block_size rows above it: the one that leaves the block.

    One memory serves both images as a ring of exactly width x block_size pairs: what is read at a place, just
    before the new pair is written there, is block_size rows old. The block size thus costs depth, not logic. Where
    ``row_old`` is 0 the old pixels are whatever the memory holds.
    """
    def __init__(self, max_width=640, max_block_size=9):
        pair_bits = 2*PIXEL_BITS
        self.sink   = stream.Endpoint(pixel_pair_layout() + position_layout(max_width)) # Pipeline.
        self.source = stream.Endpoint(pixel_pair_layout() + [
            ("left_old",  PIXEL_BITS),
            ("right_old", PIXEL_BITS),
        ] + position_layout(max_width))                                                 # Pipeline.

        self.width      = Signal(max=max_width + 1)      # Columns of the frame.
        self.block_size = Signal(max=max_block_size + 1) # Side of the block: rows of delay.
        self.latency    = 2

        # # #

        stages = pass_position(self, self.sink, self.source, self.latency)

        # Ring address: back to 0 with the first pixel of every block_size-th row.
        # ------------------------------------------------------------------------
        depth    = max_width*max_block_size
        address  = Signal(max=depth)
        ring_row = Signal(max=max_block_size)
        begin    = Signal()
        wrap     = Signal()
        row_end  = Signal()
        current  = Signal(max=depth)
        last_column = Signal(max=max_width)
        last_row    = Signal(max=max_block_size + 1)
        self.sync += [
            last_column.eq(self.width - 1),
            last_row.eq(self.block_size - 1),
        ]
        self.comb += [
            begin.eq(self.sink.row_first & self.sink.column_first),
            row_end.eq(self.sink.column == last_column),
            wrap.eq(ring_row == last_row),
            current.eq(Mux(begin, 0, address)),
        ]
        self.sync += If(self.sink.valid,
            address.eq(current + 1),
            If(begin,
                ring_row.eq(0)
            ),
            If(row_end,
                ring_row.eq(ring_row + 1),
                If(wrap,
                    ring_row.eq(0),
                    address.eq(0)
                )
            )
        )

        # Memory: read the old pair, write the new one a clock later.
        # -----------------------------------------------------------
        memory  = Memory(pair_bits, depth, name="line_buffer")
        read    = memory.get_port(mode=READ_FIRST)
        write   = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write

        pair          = Signal(pair_bits)
        write_address = Signal(max=depth)
        self.comb += read.adr.eq(current)
        self.sync += [
            pair.eq(Cat(self.sink.left, self.sink.right)),
            write_address.eq(current),
        ]
        self.comb += [
            write.adr.eq(write_address),
            write.dat_w.eq(pair),
            write.we.eq(stages[1].valid),
        ]

        # Output register behind the memory.
        # ----------------------------------
        self.sync += [
            Cat(self.source.left,     self.source.right).eq(pair),
            Cat(self.source.left_old, self.source.right_old).eq(read.dat_r),
        ]
