#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common      import *
from .memory_port import MemoryWriter, word_address, word_bytes

# Map Writer ---------------------------------------------------------------------------------------

class MapWriter(LiteXModule):
    """Write a stream of disparities to memory, int16 in raster order, in bursts.

    The base address is a multiple of the port's word. Whole words are written: up to a word less two bytes behind the map is
    overwritten with undefined values.

    A frame runs from `start` (one clock, while `idle`) to the pixel marked last. `stop`, held until `idle`, gives it up:
    what is under way is written, the rest is thrown away.
    """
    def __init__(self, port, burst_bytes=128):
        burst = burst_bytes//word_bytes(port)
        self.sink  = stream.Endpoint(disparity_layout()) # Disparities, the frame's last one marked.
        self.base  = Signal(32)                          # Byte address of the map.
        self.start = Signal()                            # Begin a frame (pulse).
        self.stop  = Signal()                            # Give the frame up (level).
        self.idle  = Signal()                            # No frame, everything is in memory.
        self.error = Signal()                            # Bus error (pulse).

        # # #

        self.writer = writer = MemoryWriter(port, fifo_depth=max(4, burst))
        self.comb += self.error.eq(writer.error)

        # Disparities to words.
        # ---------------------
        self.pack = pack = ResetInserter()(stream.Converter(DISPARITY_BITS, port.data_width))
        self.fifo = fifo = ResetInserter()(stream.SyncFIFO([("data", port.data_width)], 2*burst))
        running = Signal()
        self.comb += [
            self.sink.connect(pack.sink, omit={"disparity", "ready", "valid"}),
            pack.sink.data.eq(self.sink.disparity),
            pack.sink.valid.eq(self.sink.valid & running),
            self.sink.ready.eq(pack.sink.ready & running),
            pack.source.connect(fifo.sink, keep={"data", "valid", "ready", "last"}),
        ]

        # Words to memory: a burst when one is complete, or when the map is.
        # ------------------------------------------------------------------
        position  = Signal(32)
        under_way = Signal(max=4*burst + 1)
        packed    = Signal() # The map's last word is in the FIFO.
        asked     = Signal()
        last      = Signal()
        address, compute_address = word_address(port, self.base, position)
        self.comb += [
            compute_address,
            writer.sink.address.eq(address),
            writer.sink.data.eq(fifo.source.data),
            asked.eq(writer.sink.valid & writer.sink.ready),
            fifo.source.ready.eq(asked),
            last.eq(asked & fifo.source.last),
        ]
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += [
            self.idle.eq(fsm.ongoing("IDLE")),
            running.eq(fsm.ongoing("COLLECT") | fsm.ongoing("BURST")),
            pack.reset.eq(~running),
            fifo.reset.eq(fsm.ongoing("IDLE") | fsm.ongoing("DRAIN")),
        ]
        self.sync += [
            under_way.eq(under_way + asked - writer.written),
            If(asked,
                position.eq(position + 1)
            ),
            If(fifo.sink.valid & fifo.sink.ready & fifo.sink.last,
                packed.eq(1)
            ),
            If(fsm.ongoing("IDLE"),
                position.eq(0),
                packed.eq(0)
            ),
        ]
        fsm.act("IDLE",
            If(self.start,
                NextState("COLLECT")
            )
        )
        fsm.act("COLLECT",
            If(self.stop,
                NextState("DRAIN")
            ).Elif((fifo.level >= burst) | packed,
                NextState("BURST")
            )
        )
        fsm.act("BURST",
            writer.sink.valid.eq(fifo.source.valid),
            If(~fifo.source.valid,
                NextState("COLLECT")
            ),
            If(last,
                NextState("DRAIN")
            ),
            # A request once made stays until it is taken.
            If(self.stop,
                If(asked | ~fifo.source.valid,
                    NextState("DRAIN")
                ).Else(
                    NextState("DRAIN-REQUEST")
                )
            )
        )
        fsm.act("DRAIN-REQUEST",
            writer.sink.valid.eq(1),
            If(asked,
                NextState("DRAIN")
            )
        )
        fsm.act("DRAIN",
            If(under_way == 0,
                NextState("IDLE")
            )
        )
