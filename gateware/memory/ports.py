#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One interface to the two kinds of memory port: LiteX's Wishbone and LiteDRAM's native port.

A memory port is a `wishbone.Interface` with word addresses, a `LiteDRAMNativePort`, or a `RemotePort` to one of these
in another clock domain. Byte order in a word is the CPU's: the byte at the lowest address is in the low bits.
"""

from typing import Protocol, runtime_checkable

from migen import *

from litex.gen import *

from litex.soc.cores.dma    import WishboneDMAReader, WishboneDMAWriter
from litex.soc.interconnect import stream, wishbone

from litedram.common       import LiteDRAMNativePort
from litedram.frontend.dma import LiteDRAMDMAReader, LiteDRAMDMAWriter

from ..common import *

# Remote Port --------------------------------------------------------------------------------------

@runtime_checkable
class RemotePort(Protocol):
    """A memory port in another clock domain, as a core sees it in its own: see `PortCrossing`.

    It has the members of a `MemoryReader` or of a `MemoryWriter`, and is one or the other.
    """
    data_width : int             # Bits of a word.
    sink       : stream.Endpoint # Reader: addresses. Writer: addresses and words.
    source     : stream.Endpoint # Reader only: words.
    written    : Signal          # Writer only: a word has reached memory (pulse).
    error      : Signal          # Bus error (pulse).

# Helpers ------------------------------------------------------------------------------------------

def word_bytes(port):
    """Return the bytes of a word of the port; raise ValueError if it is no memory port."""
    check(isinstance(port, (wishbone.Interface, LiteDRAMNativePort, RemotePort)),
        f"a memory port must be a wishbone.Interface or a LiteDRAMNativePort, not a {type(port).__name__}.")
    check(port.data_width in [16, 32, 64, 128, 256],
        f"a memory port must be 16, 32, 64, 128 or 256 bits wide, not {port.data_width}.")
    return port.data_width//8

def word_address(port, base, index):
    """Return the word address that is `index` words after byte address `base`, and the statement that computes it.

    It is wider than the port's addresses, which take its low bits.
    """
    shift   = log2_int(word_bytes(port))
    address = Signal(32)
    return address, address.eq(base[shift:] + index)

def buffered(depth):
    """Return whether a FIFO of words gets an output register: a deep one should be block RAM, which needs it."""
    return depth >= 32

# Memory Reader ------------------------------------------------------------------------------------

class MemoryReader(LiteXModule):
    """Read words: for each address (and mark `last`) into the sink, one word (and its mark) out of the source.

    `sink` and `source` are endpoints of the port's DMA engine.

    Parameters
    ----------
    port : wishbone.Interface, LiteDRAMNativePort or RemotePort
        Port to read from.
    fifo_depth : int
        Words that may be under way.
    """
    def __init__(self, port, fifo_depth=16):
        word_bytes(port)
        self.error   = Signal() # The bus answered with an error; the word is undefined (pulse).
        self.latency = None     # Depends on memory.

        # # #

        if isinstance(port, RemotePort):
            self.sink   = port.sink
            self.source = port.source
            self.error  = port.error
            return
        if isinstance(port, wishbone.Interface):
            bus       = _with_errors_as_answers(self, port)
            # "big" means that the bytes of a word stay where they are.
            self.dma  = WishboneDMAReader(bus, endianness="big", fifo_depth=fifo_depth)
            self.sink = self.dma.sink
        else:
            self.dma  = LiteDRAMDMAReader(port, fifo_depth=fifo_depth, fifo_buffered=buffered(fifo_depth))
            self.sink = _registered(self, self.dma.sink)
        self.source = self.dma.source

# Memory Writer ------------------------------------------------------------------------------------

class MemoryWriter(LiteXModule):
    """Write words: for each address and word into the sink, one pulse of `written` when memory has it.

    `sink` is an endpoint of the port's DMA engine.

    Parameters
    ----------
    port : wishbone.Interface, LiteDRAMNativePort or RemotePort
        Port to write to.
    fifo_depth : int
        Words that may be under way.
    """
    def __init__(self, port, fifo_depth=16):
        word_bytes(port)
        self.written = Signal() # A word has reached memory: every read from now on sees it (pulse).
        self.error   = Signal() # The bus answered with an error; the word is lost (pulse).
        self.latency = None     # Depends on memory.

        # # #

        if isinstance(port, RemotePort):
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
            # Later commands to the bank wait for this one, so a word that was taken counts as written.
            self.comb += self.written.eq(port.wdata.valid & port.wdata.ready)
            self.sink = _registered(self, self.dma.sink)

def _registered(module, sink):
    """Return a sink with a register before `sink`.

    Register the address first: computing it and choosing a DRAM bank do not fit one clock.
    """
    module.buffer = buffer = stream.Buffer(sink.description)
    module.comb += buffer.source.connect(sink)
    return buffer.sink

def _with_errors_as_answers(module, port):
    """Return a bus to `port` on which an error ends the access as an acknowledge does, and pulses `module.error`.

    LiteX's DMA engines wait for `ack` alone: they would hang.
    """
    bus = wishbone.Interface(data_width=port.data_width, adr_width=port.adr_width, addressing="word")
    module.comb += [
        bus.connect(port, omit={"ack", "err"}),
        bus.ack.eq(port.ack | port.err),
        module.error.eq(port.cyc & port.stb & port.err),
    ]
    return bus
