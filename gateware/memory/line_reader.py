#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream, wishbone

from ..common import *

LINE_BYTES = 32 # Line of the VexRiscv's caches.

CTI_INCREMENTING = 2 # A transfer of Wishbone with others to follow, each at the next address.

# Line Reader --------------------------------------------------------------------------------------

class LineReader(LiteXModule):
    """Read a cache's lines from a separate DRAM port; pass on all other transfers of its bus, a clock later.

    On the SoC's bus every word of a line is a separate access, which waits for the memory. Here the words are asked for
    one clock after the other, and only the first one waits. If the cache gives a line up, the rest of it is discarded.
    A reset has to reach cache and memory too: it forgets what was asked for.

    Parameters
    ----------
    master : wishbone.Interface
        Bus of a cache of instructions, 32 bits wide; it reads a line as eight transfers, marked as a burst.
    port : LiteDRAMNativePort
        Port to read from, 32 bits wide or more.
    origin : int
        Byte address of the memory,
    size : int
        and its size, a power of 2 that divides `origin`.
    """
    def __init__(self, master, port, origin, size):
        ratio = port.data_width//32
        words = LINE_BYTES//4//ratio # Of the port.
        check(master.data_width == 32 and ratio in (1, 2, 4), "a line is read by 32 bits, of a port of 32, 64 or 128.")
        check(size & (size - 1) == 0 and origin % size == 0, "size must be a power of 2 that divides origin.")
        self.bus = bus = wishbone.Interface(
            data_width = master.data_width,
            adr_width  = master.adr_width,
            addressing = master.addressing,
        ) # To the interconnect.

        # # #

        self.asked    = Signal(max=words + 1)     # Words asked for,
        self.answered = Signal(max=words + 1)     # and answered.
        self.item     = Signal(max=LINE_BYTES//4) # Number of the next transfer of the line.
        self.line     = Signal(log2_int(size//LINE_BYTES))
        self.begins   = Signal()                  # The master begins a line of the memory.
        self.answer   = Signal()
        self.fifo     = fifo = ResetInserter()(stream.SyncFIFO([("data", port.data_width)], words))
        self.comb    += self.begins.eq(master.cyc & master.stb & ~master.we & (master.cti == CTI_INCREMENTING)
            & (master.adr[:3] == 0) & (master.adr[log2_int(size//4):] == origin//size))
        self.add_fsm(master, port, words)
        lane = self.item & (ratio - 1)
        self.comb += [
            bus.adr.eq(master.adr),
            bus.dat_w.eq(master.dat_w),
            bus.sel.eq(master.sel),
            bus.we.eq(master.we),
            port.cmd.we.eq(0),
            port.cmd.addr.eq(Cat(self.asked[:log2_int(words)], self.line)),
            port.rdata.ready.eq(1),
            fifo.sink.valid.eq(port.rdata.valid),
            fifo.sink.data.eq(port.rdata.data),
            fifo.source.ready.eq(self.answer & (lane == ratio - 1)),
            master.dat_r.eq(bus.dat_r),
            If(self.fsm.ongoing("LINE"),
                master.dat_r.eq(Array(lanes_of(fifo.source.data, ratio))[lane])
            ),
        ]

    def add_fsm(self, master, port, words):
        """Follow a line, or let another transfer pass."""
        bus, fifo, answer = self.bus, self.fifo, self.answer
        given_up = Signal() # The master has given the line up.
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            fifo.reset.eq(1),
            NextValue(self.line, master.adr[3:]),
            NextValue(self.asked, 0),
            NextValue(self.answered, 0),
            NextValue(self.item, 0),
            NextValue(given_up, 0),
            If(self.begins,
                NextState("LINE")
            ).Elif(master.cyc & master.stb,
                NextState("PASS")
            )
        )
        # In a separate clock: the decision and the bus do not fit one clock.
        fsm.act("PASS",
            bus.cyc.eq(master.cyc),
            bus.stb.eq(master.stb),
            master.ack.eq(bus.ack),
            master.err.eq(bus.err),
            If(~master.cyc | bus.ack | bus.err,
                NextState("IDLE")
            )
        )
        fsm.act("LINE",
            # A request once made stays until it is taken.
            port.cmd.valid.eq(self.asked != words),
            If(port.cmd.valid & port.cmd.ready,
                NextValue(self.asked, self.asked + 1)
            ),
            If(port.rdata.valid,
                NextValue(self.answered, self.answered + 1)
            ),
            answer.eq(fifo.source.valid & master.cyc & master.stb & ~given_up),
            master.ack.eq(answer),
            If(answer,
                NextValue(self.item, self.item + 1),
                If(self.item == LINE_BYTES//4 - 1,
                    NextState("IDLE")
                )
            ),
            If(~master.cyc,
                NextValue(given_up, 1)
            ),
            If(given_up & (self.answered == words),
                NextState("IDLE")
            )
        )
