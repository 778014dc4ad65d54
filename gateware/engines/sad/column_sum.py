#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ...common import *
from ..costs   import *

BLOCK_RAM_BITS = 18 # Width of a block RAM of 1024 words, on the ECP5 and most others.

# Column Sum ---------------------------------------------------------------------------------------

@ResetInserter()
class ColumnSum(LiteXModule):
    """Per lane, the sum of the absolute differences of the last block_size pixels of a column.

    The sums of the row above wait in memory, a word of all lanes per column: each gains the pixel that enters and loses
    the one that leaves, as `AbsoluteDifference` gives them. Arithmetic is modulo 2**column_bits, so a sum is exact as
    soon as all of its pixels are.
    """
    def __init__(self, parameters):
        in_bits, bits, lanes = parameters.filtered_bits, parameters.column_bits, parameters.lanes
        self.sink = stream.Endpoint([
            ("enter", lanes*(in_bits + 1)),
            ("leave", lanes*(in_bits + 1)),
        ] + position_layout(parameters))                                         # Pipeline.
        self.source  = stream.Endpoint(lanes_layout("sums", bits, parameters)) # Pipeline.
        self.latency = 3

        # # #

        stages = pass_position(self, self.sink, self.source, self.latency)

        # Memory of the row above, with a register behind it: block RAM is slow to answer.
        # ---------------------------------------------------------------------------------
        # In pieces of a block RAM's width at a depth of 1024: left to itself, Yosys stacks wider ones, with multiplexers.
        above_row = Signal(lanes*bits, reset_less=True)
        for start in range(0, lanes*bits, BLOCK_RAM_BITS):
            piece  = slice(start, min(start + BLOCK_RAM_BITS, lanes*bits))
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
            # A register that is reset takes no logic, a multiplexer behind it would.
            self.sync += above_row[piece].eq(Mux(stages[1].row_first, 0, read.dat_r))

        # Lanes: change of the sum, then the sum, each with a carry.
        # ----------------------------------------------------------
        for enter, leave, above, total in zip(
            lanes_of(self.sink.enter,  lanes),
            lanes_of(self.sink.leave,  lanes),
            lanes_of(above_row,        lanes),
            lanes_of(self.source.sums, lanes),
        ):
            entering = Signal(in_bits + 1, reset_less=True)
            # Inverted, as it is subtracted.
            leaving  = Signal(in_bits + 1, reset=2**(in_bits + 1) - 1, reset_less=True)
            change   = Signal(in_bits + 2, reset_less=True) # Less one; the lowest bit is that of the carry.
            behind   = Signal()                             # That one, less the one of the leaving difference.
            result   = Signal(bits + 1, reset_less=True)
            self.sync += [
                entering.eq(enter),
                leaving.eq(Mux(self.sink.row_old, ~leave, 2**(in_bits + 1) - 1)),
                change.eq(Cat(1, entering[:-1], 0) + Cat(entering[-1], leaving[:-1], 1)),
                behind.eq(leaving[-1]),
                result.eq(Cat(1, above) + Cat(behind, sign_extended(change[1:], bits))),
            ]
            self.comb += total.eq(result[1:])
