#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common        import *
from ..engines.costs import *

# Alignment ----------------------------------------------------------------------------------------

@ResetInserter()
class Alignment(LiteXModule):
    """Delay both images within the row, so that the pixels of the smallest disparity meet in one step.

    The left image is delayed by `outer` columns, the right one by min_disparity columns, and by `outer` more where
    ``late`` is set. The last columns of each wait in a ring memory.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(positioned_pair_layout(parameters)) # Pipeline.
        self.source = stream.Endpoint(positioned_pair_layout(parameters)) # Pipeline.

        self.min_disparity = Signal(max=MAX_MIN_DISPARITY + 1)        # Delay of the right image, columns.
        self.outer         = Signal(max=max(parameters.outer, 1) + 1) # Delay of both images, columns.

        # # #

        left_delay  = parameters.outer
        right_delay = left_delay + (MAX_MIN_DISPARITY if "min_disparity" in parameters.features else 0)
        if right_delay == 0:
            self.latency = 0
            self.comb += connect_pipeline(self.sink, self.source)
            return

        self.latency = 4 # Pixels, read address, memory, its register.
        stages        = pass_position(self, self.sink, self.source, self.latency)
        column        = Signal(bits_for(right_delay)) # Of this step, modulo the depth of the ring.
        left_columns  = Signal(len(column))
        right_columns = Signal(len(column))
        self.sync += [
            If(self.sink.valid,
                column.eq(column + 1)
            ),
            left_columns.eq(self.outer),
            right_columns.eq(self.min_disparity + Mux(self.sink.late, self.outer, 0)),
        ]
        here = delayed(self, column, 1)
        self.add_ring("left",  left_delay,  stages, here, left_columns)
        self.add_ring("right", right_delay, stages, here, right_columns)

    def add_ring(self, side, longest, stages, column, delay):
        """Delay one image, both the row that enters and the one that leaves: written at clock 1, read at clock 2."""
        names  = [side, f"{side}_old"]
        new    = Cat(*[getattr(self.sink,   name) for name in names])
        output = Cat(*[getattr(self.source, name) for name in names])
        if longest == 0:
            self.comb += output.eq(delayed(self, new, self.latency))
            return
        depth  = 2**bits_for(longest)
        memory = Memory(len(new), depth, name=f"alignment_{side}")
        read   = memory.get_port(mode=READ_FIRST)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        written      = delayed(self, new, 1)
        read_address = Signal(max=depth)
        out_register = Signal(len(new))
        self.comb += [
            write.adr.eq(column),
            write.dat_w.eq(written),
            write.we.eq(stages[1].valid),
            read.adr.eq(read_address),
            output.eq(out_register),
        ]
        self.sync += [
            read_address.eq(column - delay),
            out_register.eq(read.dat_r),
        ]
