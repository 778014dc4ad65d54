#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import wishbone

# Bus Register -------------------------------------------------------------------------------------

class BusRegister(LiteXModule):
    """A clock between a bus and its master: answers pass a register.

    Without it an address of the CPU goes through arbiter, decoder, peripheral and back into the CPU's pipeline in one
    clock. With it a transfer takes a clock more. A reset withdraws the answer, as it does the CPU's request.

    Parameters
    ----------
    master : wishbone.Interface
        Master, classic cycles; bursts become single transfers.
    """
    def __init__(self, master):
        self.bus = bus = wishbone.Interface(
            data_width = master.data_width,
            adr_width  = master.adr_width,
            addressing = master.addressing,
        ) # To the interconnect.

        # # #

        answered = Signal()
        self.comb += [
            answered.eq(master.ack | master.err),
            bus.adr.eq(master.adr),
            bus.dat_w.eq(master.dat_w),
            bus.sel.eq(master.sel),
            bus.we.eq(master.we),
            # In the clock of the answer the request is still there.
            bus.cyc.eq(master.cyc & ~answered),
            bus.stb.eq(master.stb & ~answered),
        ]
        self.sync += [
            master.ack.eq(bus.cyc & bus.stb & bus.ack),
            master.err.eq(bus.cyc & bus.stb & bus.err),
            master.dat_r.eq(bus.dat_r),
        ]
