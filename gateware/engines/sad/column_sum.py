#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common       import *
from ..costs          import *
from .difference_pair import difference_pair_layout

BLOCK_RAM_BITS = 18 # Width of a block RAM of 1024 words, on the ECP5 and most others.

# Column Sum ---------------------------------------------------------------------------------------

@ResetInserter()
class ColumnSum(LiteXModule):
    """Per lane, the sum of the absolute differences of the last block_size pixels of a column.

    The sums of the row above wait in memory, a word of all lanes per column. Each gains the difference that enters and
    loses the one that leaves:

        sum = above + enter - leave

    Both are numbers with a carry (`with_carry`), and -x is ~x + 1, so in two steps of one adder each:

        change   = value(enter) + carry(enter) + ~value(leave)
        carry_in = 1 - carry(leave)
        sum      = above + change + carry_in

    Arithmetic is modulo 2**column_bits, so a sum is exact as soon as all of its pixels are.
    """
    def __init__(self, parameters):
        in_bits, bits, lanes = parameters.filtered_bits, parameters.column_bits, parameters.lanes
        self.sink    = stream.Endpoint(difference_pair_layout(parameters))     # Pipeline.
        self.source  = stream.Endpoint(lanes_layout("sums", bits, parameters)) # Pipeline.
        self.latency = 3                                                       # Differences, change, sum.

        # # #

        stages    = pass_position(self, self.sink, self.source, self.latency)
        above_row = self.add_memory(parameters, stages)

        # Lanes.
        # ------
        for enter, leave, above, total in zip(
            lanes_of(self.sink.enter,  lanes),
            lanes_of(self.sink.leave,  lanes),
            lanes_of(above_row,        lanes),
            lanes_of(self.source.sums, lanes),
        ):
            zero     = 2**(in_bits + 1) - 1 # Inverted, as all that leaves.
            entering = Signal(in_bits + 1, reset_less=True)
            leaving  = Signal(in_bits + 1, reset=zero, reset_less=True)
            # Both adders get their carry as the bit below the numbers: 1 + carry overflows into them.
            change   = Signal(in_bits + 2, reset_less=True)
            carry_in = Signal()
            result   = Signal(bits + 1, reset_less=True)
            self.sync += [
                entering.eq(enter),
                leaving.eq(Mux(self.sink.row_old, ~leave, zero)),
                change.eq(Cat(1, value_of(entering), 0) + Cat(carry_of(entering), value_of(leaving), 1)),
                carry_in.eq(carry_of(leaving)),
                result.eq(Cat(1, above) + Cat(carry_in, sign_extended(change[1:], bits))),
            ]
            self.comb += total.eq(result[1:])

    def add_memory(self, parameters, stages):
        """Return the sums of the row above, with a register after the memory: block RAM is slow to answer.

        The memory is in pieces as wide as a block RAM of 1024 words: Yosys would stack wider ones, with multiplexers.
        """
        bits      = parameters.lanes*parameters.column_bits
        above_row = Signal(bits, reset_less=True)
        for start in range(0, bits, BLOCK_RAM_BITS):
            piece  = slice(start, min(start + BLOCK_RAM_BITS, bits))
            memory = Memory(piece.stop - piece.start, parameters.cost_columns, name="column_sums")
            read   = memory.get_port(mode=READ_FIRST)
            write  = memory.get_port(write_capable=True, mode=READ_FIRST)
            self.specials += memory, read, write
            self.comb += [
                read.adr.eq(self.sink.cost_column),
                write.adr.eq(self.source.cost_column),
                write.dat_w.eq(self.source.sums[piece]),
                write.we.eq(self.source.valid),
            ]
            self.sync += above_row[piece].eq(only_if(~stages[1].row_first, read.dat_r))
        return above_row
