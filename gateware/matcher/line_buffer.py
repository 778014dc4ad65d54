#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common        import *
from ..engines.costs import *

# Line Buffer --------------------------------------------------------------------------------------

@ResetInserter()
class LineBuffer(LiteXModule):
    """Add to each pixel pair the pair block_size rows above it: the one that leaves the block.

    One memory serves both images as a ring of exactly width x block_size pairs: what is read at an address, just before
    the new pair is written there, is block_size rows old. So a larger block costs depth, not logic. Where ``row_old``
    is 0 the old pixels are undefined.
    """
    def __init__(self, parameters):
        bits = parameters.filtered_bits
        self.sink   = stream.Endpoint(pixel_pair_layout(bits) + position_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint(positioned_pair_layout(parameters))                    # Pipeline.

        self.block_size = Signal(max=parameters.max_block_size + 1) # Side of the block: rows of delay.
        self.latency    = 2                                         # Memory, its register.

        # # #

        stages = pass_position(self, self.sink, self.source, self.latency)

        depth   = parameters.max_width*parameters.max_block_size
        address = self.add_address(parameters, depth)
        self.add_memory(bits, depth, address, stages)

    def add_address(self, parameters, depth):
        """Return the ring address of a step: back to 0 with the first pixel of every block_size-th row."""
        address  = Signal(max=depth)
        ring_row = Signal(max=parameters.max_block_size)
        begin    = Signal()
        current  = Signal(max=depth)
        last_row = Signal(max=parameters.max_block_size + 1)
        self.sync += last_row.eq(self.block_size - 1)
        self.comb += [
            begin.eq(self.sink.row_first & self.sink.pixel_first),
            current.eq(Mux(begin, 0, address)),
        ]
        self.sync += If(self.sink.valid & self.sink.pixel,
            address.eq(current + 1),
            If(begin,
                ring_row.eq(0)
            ),
            If(self.sink.pixel_last,
                ring_row.eq(ring_row + 1),
                If(ring_row == last_row,
                    ring_row.eq(0),
                    address.eq(0)
                )
            )
        )
        return current

    def add_memory(self, bits, depth, address, stages):
        """Read the old pair, write the new one a clock later; then a register for both."""
        memory  = Memory(2*bits, depth, name="line_buffer")
        read    = memory.get_port(mode=READ_FIRST)
        write   = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write

        pair          = Signal(2*bits)
        write_address = Signal(max=depth)
        self.comb += read.adr.eq(address)
        self.sync += [
            pair.eq(Cat(self.sink.left, self.sink.right)),
            write_address.eq(address),
        ]
        self.comb += [
            write.adr.eq(write_address),
            write.dat_w.eq(pair),
            write.we.eq(stages[1].valid & stages[1].pixel),
        ]

        self.sync += [
            Cat(self.source.left,     self.source.right).eq(pair),
            Cat(self.source.left_old, self.source.right_old).eq(read.dat_r),
        ]
