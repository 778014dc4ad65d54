#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One face for the two kinds of memory port: LiteX's Wishbone and LiteDRAM's native port.

A port read or written here is a `wishbone.Interface` with word addresses, a `LiteDRAMNativePort`, or one of these in another
clock domain, by way of a `FarPort`. Byte order in a word is the CPU's: the byte at the lowest address is in the low bits.
"""

from migen import *

from litex.gen import *

from litex.soc.cores.dma    import WishboneDMAReader, WishboneDMAWriter
from litex.soc.interconnect import wishbone

from litedram.common       import LiteDRAMNativePort
from litedram.frontend.dma import LiteDRAMDMAReader, LiteDRAMDMAWriter

from ..common import *

# Far Port -----------------------------------------------------------------------------------------

class FarPort:
    """What a core sees of a port in another clock domain: see `PortCrossing`.

    It has `data_width` and the faces of a `MemoryReader` or a `MemoryWriter`: `sink`, `error`, and `source` or `written`.
    """

# Helpers ------------------------------------------------------------------------------------------

def word_bytes(port):
    """Bytes of the port's words."""
    check(isinstance(port, (wishbone.Interface, LiteDRAMNativePort, FarPort)),
        f"a memory port must be a wishbone.Interface or a LiteDRAMNativePort, not a {type(port).__name__}.")
    check(port.data_width in [16, 32, 64, 128, 256],
        f"a memory port must be 16, 32, 64, 128 or 256 bits wide, not {port.data_width}.")
    return port.data_width//8

def word_address(port, base, index):
    """Address of the port's word `index` after byte address `base`, cut to the port's address bits."""
    shift   = log2_int(word_bytes(port))
    address = Signal(32)
    return address, address.eq(base[shift:] + index)

def buffered(depth):
    """Whether a FIFO of words gets an output register, and with it can be block RAM: deep ones are large without."""
    return depth >= 32

# Memory Reader ------------------------------------------------------------------------------------

class MemoryReader(LiteXModule):
    """Read words: for each address (and mark `last`) into the sink, one word (and its mark) out of the source."""
    def __init__(self, port, fifo_depth=16):
        word_bytes(port)
        self.error = Signal() # The bus answered with an error; the word is whatever the bus held.

        # # #

        if isinstance(port, FarPort):
            self.sink   = port.sink
            self.source = port.source
            self.error  = port.error
            return
        if isinstance(port, wishbone.Interface):
            bus       = _with_errors_as_answers(self, port)
            # "big" is LiteX's name for: leave the bytes of a word where they are.
            self.dma  = WishboneDMAReader(bus, endianness="big", fifo_depth=fifo_depth)
            self.sink = self.dma.sink
        else:
            self.dma  = LiteDRAMDMAReader(port, fifo_depth=fifo_depth, fifo_buffered=buffered(fifo_depth))
            self.sink = _registered(self, self.dma.sink)
        self.source = self.dma.source

# Memory Writer ------------------------------------------------------------------------------------

class MemoryWriter(LiteXModule):
    """Write words: for each address and word into the sink, one pulse of `written` when memory has it."""
    def __init__(self, port, fifo_depth=16):
        word_bytes(port)
        self.written = Signal() # A word has reached memory: whoever reads it from now on sees it.
        self.error   = Signal() # The bus answered with an error; the word is lost.

        # # #

        if isinstance(port, FarPort):
            self.sink    = port.sink
            self.written = port.written
            self.error   = port.error
            return
        if isinstance(port, wishbone.Interface):
            bus       = _with_errors_as_answers(self, port)
            self.dma  = WishboneDMAWriter(bus, endianness="big")
            self.sink = self.dma.sink
            self.comb += self.written.eq(bus.stb & bus.ack)
        else:
            self.dma  = LiteDRAMDMAWriter(port, fifo_depth=fifo_depth, fifo_buffered=buffered(fifo_depth))
            # Later commands to the bank queue behind this one, so taken is as good as written.
            self.comb += self.written.eq(port.wdata.valid & port.wdata.ready)
            self.sink = _registered(self, self.dma.sink)

def _registered(module, sink):
    """Sink with a register in front of `sink`: in the clock of its computing an address picks no bank of the RAM besides."""
    module.buffer = buffer = stream.Buffer(sink.description)
    module.comb += buffer.source.connect(sink)
    return buffer.sink

def _with_errors_as_answers(module, port):
    """Bus towards `port` on which an error ends the access as an acknowledge does, and pulses `module.error`.

    LiteX's DMA engines wait for `ack` alone and would hang.
    """
    bus = wishbone.Interface(data_width=port.data_width, adr_width=port.adr_width, addressing="word")
    module.comb += [
        bus.connect(port, omit={"ack", "err"}),
        bus.ack.eq(port.ack | port.err),
        module.error.eq(port.cyc & port.stb & port.err),
    ]
    return bus
