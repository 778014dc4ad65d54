#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .ports   import MemoryReader, word_address, word_bytes

# Stream Reader ------------------------------------------------------------------------------------

class StreamReader(LiteXModule):
    """Read a block of memory as a stream of items.

    The base address is a multiple of the port's word. A block runs from `start` (one clock, while `idle`) to the item
    marked last; the last item may reach beyond `length` bytes.

    It is reset with its clock domain alone, and its memory with it: an answer under way would be taken for a later one.

    Parameters
    ----------
    port : wishbone.Interface or LiteDRAMNativePort
        Port to read from.
    bits : int
        Bits of an item, at most those of the port's words.
    burst_bytes : int
        Bytes that are asked for before they are taken, at most.
    """
    def __init__(self, port, bits, burst_bytes=128):
        lanes = port.data_width//bits
        check(lanes >= 1, f"items of {bits} bits do not fit the port's words of {port.data_width}.")
        self.source  = stream.Endpoint([("data", bits)]) # Items, the block's last one marked.
        self.base    = Signal(32)                        # Byte address of the first.
        self.length  = Signal(16)                        # Bytes, at least 1.
        self.start   = Signal()                          # Begin a block (pulse).
        self.idle    = Signal()                          # No block.
        self.error   = Signal()                          # Bus error (pulse).
        self.latency = None                              # Depends on memory.

        # # #

        self.reader    = reader = MemoryReader(port, fifo_depth=max(4, burst_bytes//word_bytes(port)))
        self.last_byte = Signal(16) # Offset of the block's last byte.
        self.comb += [
            self.error.eq(reader.error),
            self.last_byte.eq(self.length - 1),
        ]

        self.add_addresses(port)
        self.add_items(bits, lanes)

    def add_addresses(self, port):
        """Ask for the words of the block, one after the other."""
        reader    = self.reader
        asking    = Signal()   # Words are to be asked for.
        position  = Signal(16) # Number of the next one,
        last_word = Signal(16) # and of the last one.
        address, compute_address = word_address(port, self.base, position)
        self.comb += [
            compute_address,
            last_word.eq(self.last_byte[log2_int(word_bytes(port)):]),
            reader.sink.valid.eq(asking),
            reader.sink.address.eq(address),
            reader.sink.last.eq(position == last_word),
        ]
        self.sync += [
            If(asking & reader.sink.ready,
                position.eq(position + 1),
                If(reader.sink.last,
                    asking.eq(0)
                )
            ),
            If(self.start & self.idle,
                asking.eq(1),
                position.eq(0)
            ),
        ]

    def add_items(self, bits, lanes):
        """Cut the words into items."""
        running   = Signal()                  # Items are to come.
        lane      = Signal(max=max(lanes, 2)) # Place of the next one in its word.
        item      = Signal(16)                # Number of the next one,
        last_item = Signal(16)                # and of the last one.
        moves     = Signal()                  # It is taken.
        self.comb += [
            self.idle.eq(~running),
            last_item.eq(self.last_byte[log2_int(bits//8):]),
            self.source.valid.eq(running & self.reader.source.valid),
            self.source.data.eq(Array(lanes_of(self.reader.source.data, lanes))[lane]),
            self.source.last.eq(item == last_item),
            moves.eq(self.source.valid & self.source.ready),
            self.reader.source.ready.eq(moves & ((lane == lanes - 1) | self.source.last)),
        ]
        self.sync += [
            If(moves,
                item.eq(item + 1),
                lane.eq(lane + 1),
                If((lane == lanes - 1) | self.source.last,
                    lane.eq(0)
                ),
                If(self.source.last,
                    running.eq(0)
                )
            ),
            If(self.start & self.idle,
                running.eq(1),
                item.eq(0),
                lane.eq(0)
            ),
        ]
