#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *
from ..costs   import *

# Block Sum ----------------------------------------------------------------------------------------

@ResetInserter()
class BlockSum(LiteXModule):
    """Per lane, the sum of the last block_size column sums: the cost of the block that ends here.

    A sum along the row gains the newest column and loses the one block_size columns back, which comes from a small ring
    memory. Arithmetic is modulo 2**cost_bits, so a cost is exact as soon as all of its columns are.
    """
    def __init__(self, parameters):
        in_bits, out_bits, lanes = parameters.column_bits, parameters.cost_bits, parameters.lanes
        self.sink   = stream.Endpoint(lanes_layout("sums",  in_bits,  parameters)) # Pipeline.
        self.source = stream.Endpoint(cost_layout(parameters))                     # Pipeline.

        self.block_size = Signal(max=parameters.max_block_size + 1) # Side of the block: columns of delay.
        self.latency    = 3                                         # Columns, change, cost.

        # # #

        stages        = pass_position(self, self.sink, self.source, self.latency)
        sums, columns = self.add_ring(parameters, stages)

        # Lanes: change of the cost, then the cost.
        # -----------------------------------------
        for newest, oldest, cost in zip(
            lanes_of(sums,              lanes),
            lanes_of(columns,           lanes),
            lanes_of(self.source.costs, lanes),
        ):
            change = Signal(in_bits + 1, reset_less=True)
            start  = Signal(out_bits)
            result = Signal(out_bits, reset_less=True)
            self.sync += change.eq(newest - oldest)
            self.comb += start.eq(Mux(stages[2].cost_first, 0, result))
            self.sync += If(stages[2].valid, result.eq(start + sign_extended(change, out_bits)))
            self.comb += cost.eq(result)

    def add_ring(self, parameters, stages):
        """Keep the last block_size columns; return the sums that enter the blocks and those that leave, at clock 1."""
        bits   = parameters.lanes*parameters.column_bits
        memory = Memory(bits, parameters.max_block_size, name="block_columns")
        read   = memory.get_port(async_read=True)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write

        address       = Signal(max=parameters.max_block_size)
        write_address = Signal(max=parameters.max_block_size)
        sums          = Signal(bits, reset_less=True)
        last          = Signal(max=parameters.max_block_size + 1)
        self.comb += read.adr.eq(address)
        columns       = Signal(bits, reset_less=True)
        self.sync += [
            last.eq(self.block_size - 1),
            If(self.sink.valid,
                address.eq(address + 1),
                # >=: the block size may have become smaller since the frame before.
                If(address >= last,
                    address.eq(0)
                )
            ),
            write_address.eq(address),
            sums.eq(self.sink.sums),
            columns.eq(only_if(self.sink.cost_old, read.dat_r)),
        ]
        self.comb += [
            write.adr.eq(write_address),
            write.dat_w.eq(sums),
            write.we.eq(stages[1].valid),
        ]
        return sums, columns
