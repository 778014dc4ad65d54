#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common import *

# Column Sum ---------------------------------------------------------------------------------------

@ResetInserter()
class ColumnSum(LiteXModule):
    """Per lane, the sum of the absolute differences of the last block_size pixels of a column.

    The sums of the row above wait in one memory, a word of all lanes per column: each gains the pixel that enters and
    loses the one that leaves. Arithmetic is modulo 2**column_bits, so a sum is exact as soon as all of its
    pixels are.
    """
    def __init__(self, parameters):
        in_bits, bits, lanes = parameters.filtered_bits, parameters.column_bits, parameters.lanes
        self.sink = stream.Endpoint([
            ("enter", lanes*in_bits),
            ("leave", lanes*in_bits),
        ] + position_layout(parameters))                                         # Pipeline.
        self.source  = stream.Endpoint(lanes_layout("sums", bits, parameters)) # Pipeline.
        self.latency = 3

        # # #

        stages = pass_position(self, self.sink, self.source, self.latency)

        # Memory of the row above, with a register behind it: block RAM is slow to answer.
        # ---------------------------------------------------------------------------------
        memory = Memory(lanes*bits, parameters.cost_columns, name="column_sums")
        read   = memory.get_port(mode=READ_FIRST)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        self.comb += [
            read.adr.eq(self.sink.cost_column),
            write.adr.eq(self.source.cost_column),
            write.dat_w.eq(self.source.sums),
            write.we.eq(self.source.valid),
        ]
        above_row = Signal(lanes*bits)
        # A register that is reset takes no logic, a multiplexer behind it would.
        self.sync += above_row.eq(Mux(stages[1].row_first, 0, read.dat_r))

        # Lanes: change of the sum, then the sum.
        # ---------------------------------------
        for enter, leave, above, total in zip(
            lanes_of(self.sink.enter,  lanes),
            lanes_of(self.sink.leave,  lanes),
            lanes_of(above_row,        lanes),
            lanes_of(self.source.sums, lanes),
        ):
            leaving  = Signal(in_bits)
            entering = Signal(in_bits)
            change   = Signal(bits)
            result   = Signal(bits)
            self.sync += [
                entering.eq(enter),
                leaving.eq(Mux(self.sink.row_old, leave, 0)),
                change.eq(entering - leaving),
            ]
            self.sync += result.eq(above + change)
            self.comb += total.eq(result)
