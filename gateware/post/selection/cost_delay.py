#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ...common import *

# Cost Delay ---------------------------------------------------------------------------------------

@ResetInserter()
class CostDelay(LiteXModule):
    """All costs of a block, as they were `latency` clocks ago: they wait here until their winner is known.

    A memory makes the delay, which a reset does not clear.
    """
    def __init__(self, parameters, latency):
        bits = parameters.disparities*parameters.cost_bits
        self.sink    = Signal(bits)                  # Costs.
        self.source  = Signal(bits, reset_less=True) # Costs `latency` clocks later.
        self.latency = latency

        # # #

        # A ring memory, one word per clock: written a clock after it is read, with a register after it.
        depth = latency - 2
        check(depth >= 2, f"latency must be at least 4, not {latency}.")
        memory = Memory(bits, depth, name="costs")
        read   = memory.get_port(mode=READ_FIRST)
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        self.specials += memory, read, write
        address = Signal(max=depth)
        self.sync += [
            address.eq(address + 1),
            If(address == depth - 1,
                address.eq(0)
            ),
            self.source.eq(read.dat_r),
        ]
        self.comb += [
            read.adr.eq(address),
            write.adr.eq(delayed(self, address, 1)),
            write.dat_w.eq(delayed(self, self.sink, 1)),
            write.we.eq(1),
        ]
