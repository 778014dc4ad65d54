#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from litedram.common import LiteDRAMNativePort

from ...gateware.common.stream_register import add_register

# Screen Turns -------------------------------------------------------------------------------------

class ScreenTurns(LiteXModule):
    """Times in which the memory serves the screen alone: from when a quarter of its FIFO is left until it is almost full.

    The matcher takes all that the memory can give, and a screen does not wait. In between it asks for nothing, so that no
    word of it costs the others a row.

    Parameters
    ----------
    dma : LiteDRAMDMAReader
        What reads for the screen.
    words : int
        Words of its FIFO.
    """
    def __init__(self, dma, words):
        self.turn = turn = Signal() # The memory is the screen's.

        # # #

        # Words that were asked for and have not left the FIFO.
        count  = Signal(max=words + 1)
        asked  = Signal()
        leaves = Signal()
        self.comb += [
            asked.eq(dma.port.cmd.valid & dma.port.cmd.ready),
            leaves.eq(dma.source.valid & dma.source.ready),
        ]
        self.sync += [
            If(asked & ~leaves, count.eq(count + 1)),
            If(leaves & ~asked, count.eq(count - 1)),
            If(count <= words//4, turn.eq(1)),
            If(count >= words - words//8, turn.eq(0)),
            # Switched off, it asks for nothing, and drops what is left.
            If(~dma.enable,
                count.eq(0),
                turn.eq(0),
            ),
        ]

    def add_gate(self, port, is_screen):
        """Returns a port for the crossbar whose commands are those of `port` when it is its turn."""
        gated = LiteDRAMNativePort(port.mode, port.address_width, port.data_width, id=port.id)
        turn  = self.turn if is_screen else ~self.turn
        cmd   = gated.cmd
        if is_screen:
            # The reader compares its offset and waits for the memory in one clock: let it not wait for what is far.
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
