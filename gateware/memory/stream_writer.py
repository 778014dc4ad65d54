#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .ports   import MemoryWriter, buffered, word_address, word_bytes

# Stream Writer ------------------------------------------------------------------------------------

class StreamWriter(LiteXModule):
    """Write a stream of items to memory, in bursts.

    The base address is a multiple of the port's word. Whole words are written: after the last item, the rest of its
    word is overwritten with undefined values.

    A block runs from `start` (one clock, while `idle`) to the item marked last. `stop`, held until `idle`, gives it up:
    words under way are written, the others are discarded.

    It is reset with its clock domain alone, and its memory with it: an answer under way would be taken for a later one.

    Parameters
    ----------
    port : wishbone.Interface or LiteDRAMNativePort
        Port to write to.
    bits : int
        Bits of an item, at most those of the port's words.
    burst_bytes : int
        Bytes of a burst.
    """
    def __init__(self, port, bits, burst_bytes=128):
        burst = burst_bytes//word_bytes(port)
        check(bits <= port.data_width, f"items of {bits} bits do not fit the port's words of {port.data_width}.")
        self.sink    = stream.Endpoint([("data", bits)]) # Items, the block's last one marked.
        self.base    = Signal(32)                        # Byte address of the first.
        self.start   = Signal()                          # Begin a block (pulse).
        self.stop    = Signal()                          # Give the block up (level).
        self.idle    = Signal()                          # No block, everything is in memory.
        self.error   = Signal()                          # Bus error (pulse).
        self.latency = None                              # Depends on memory.

        # # #

        self.writer  = writer = MemoryWriter(port, fifo_depth=max(4, burst))
        self.fifo    = ResetInserter()(stream.SyncFIFO([("data", port.data_width)], 2*burst, buffered(2*burst)))
        self.running = Signal() # Items are taken.
        self.asked   = Signal() # A word goes to memory.
        self.comb   += self.error.eq(writer.error)

        self.add_words(port.data_width//bits)
        self.add_addresses(port)
        self.add_bursts(burst)

    def add_words(self, lanes):
        """Pack items into words. (LiteX's Converter would do, but its mark `last` outlives a reset.)"""
        fifo      = self.fifo
        word      = Signal(len(fifo.sink.data))
        lane      = Signal(max=max(lanes, 2)) # Place of the next item in the word.
        full      = Signal()                  # The word is complete,
        last_word = Signal()                  # and the block's last.
        self.comb += [
            self.sink.ready.eq(self.running & (~full | fifo.sink.ready)),
            fifo.sink.valid.eq(full),
            fifo.sink.data.eq(word),
            fifo.sink.last.eq(last_word),
        ]
        self.sync += [
            If(fifo.sink.ready,
                full.eq(0)
            ),
            If(self.sink.valid & self.sink.ready,
                Case(lane, {n: part.eq(self.sink.data) for n, part in enumerate(lanes_of(word, lanes))}),
                lane.eq(lane + 1),
                If((lane == lanes - 1) | self.sink.last,
                    lane.eq(0),
                    full.eq(1),
                    last_word.eq(self.sink.last)
                )
            ),
            If(~self.running,
                lane.eq(0),
                full.eq(0)
            ),
        ]

    def add_addresses(self, port):
        """Address the words that leave the FIFO."""
        fifo, writer = self.fifo, self.writer
        position = Signal(32)
        address, compute_address = word_address(port, self.base, position)
        self.comb += [
            compute_address,
            writer.sink.address.eq(address),
            writer.sink.data.eq(fifo.source.data),
            self.asked.eq(writer.sink.valid & writer.sink.ready),
            fifo.source.ready.eq(self.asked),
        ]
        self.sync += [
            If(self.asked,
                position.eq(position + 1)
            ),
            If(self.idle,
                position.eq(0)
            ),
        ]

    def add_bursts(self, burst):
        """Add the states of a block: write a burst when the FIFO holds one, or holds the block's last word."""
        fifo, writer, asked = self.fifo, self.writer, self.asked
        under_way = Signal(max=4*burst + 1) # Words asked for and not yet written.
        packed    = Signal()                # The block's last word is in the FIFO.
        last      = Signal()
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += [
            self.idle.eq(fsm.ongoing("IDLE")),
            self.running.eq(fsm.ongoing("COLLECT") | fsm.ongoing("BURST")),
            fifo.reset.eq(fsm.ongoing("IDLE") | fsm.ongoing("DRAIN")),
            last.eq(asked & fifo.source.last),
        ]
        self.sync += [
            under_way.eq(under_way + asked - writer.written),
            If(fifo.sink.valid & fifo.sink.ready & fifo.sink.last,
                packed.eq(1)
            ),
            If(fsm.ongoing("IDLE"),
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
