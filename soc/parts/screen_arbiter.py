#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from litedram.common import LiteDRAMNativePort

from ...gateware.common.stream_register import add_register

# Screen Arbiter -----------------------------------------------------------------------------------

class ScreenArbiter(LiteXModule):
    """Give the memory to the screen alone from when its FIFO is down to a quarter until it is almost full.

    The matcher takes all bandwidth of the memory, and a screen does not wait. Between its turns the screen requests
    nothing: a single word would cost the other masters an open row of the RAM. It is reset with its clock
    domain alone.

    Parameters
    ----------
    dma : LiteDRAMDMAReader
        Reader of the screen's picture.
    words : int
        Words that its FIFO holds.
    """
    def __init__(self, dma, words):
        self.screen_turn = screen_turn = Signal() # The memory serves the screen alone.

        # # #

        count  = Signal(max=words + 1) # Words requested that have not yet come out of the FIFO.
        asked  = Signal()
        leaves = Signal()
        self.comb += [
            asked.eq(dma.port.cmd.valid & dma.port.cmd.ready),
            leaves.eq(dma.source.valid & dma.source.ready),
        ]
        self.sync += [
            If(asked & ~leaves, count.eq(count + 1)),
            If(leaves & ~asked, count.eq(count - 1)),
            If(count <= words//4, screen_turn.eq(1)),
            If(count >= words - words//8, screen_turn.eq(0)),
            # While the screen is off, the reader requests nothing, and its FIFO is emptied.
            If(~dma.enable,
                count.eq(0),
                screen_turn.eq(0),
            ),
        ]

    def add_gate(self, port, is_screen):
        """Return a port for the crossbar: it passes the commands of `port` in the screen's turns, or between them."""
        gated = LiteDRAMNativePort(port.mode, port.address_width, port.data_width, id=port.id)
        turn  = self.screen_turn if is_screen else ~self.screen_turn
        cmd   = gated.cmd
        if is_screen:
            # The reader compares its offset in the clock in which it sees `ready`: this register cuts the path from the
            # crossbar.
            cmd = stream.Endpoint(gated.cmd.description)
            add_register(self, cmd, gated.cmd)
        self.comb += [
            port.cmd.connect(cmd, omit={"valid", "ready"}),
            cmd.valid.eq(port.cmd.valid & turn),
            port.cmd.ready.eq(cmd.ready & turn),
            port.wdata.connect(gated.wdata),
            gated.rdata.connect(port.rdata),
            gated.flush.eq(port.flush),
            port.lock.eq(gated.lock),
        ]
        return gated
