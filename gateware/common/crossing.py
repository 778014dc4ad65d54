#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import GrayCounter, MultiReg

from litex.gen import *

from litex.soc.interconnect import stream

# Crossing -----------------------------------------------------------------------------------------

class Crossing(LiteXModule):
    """A stream from one clock domain to another.

    As LiteX's ClockDomainCrossing, but with the read address in a register, and distributed memory. On an ECP5 LiteX's
    looks up whether there is a word, moves the address and reads the memory in one clock, which is too slow for the
    125 MHz of a wire. Put a register after it.

    Parameters
    ----------
    layout : list
        Payload of the stream.
    cd_from, cd_to : str
        Clock domains; a reset must hold both for some clocks.
    depth : int
        Room in items, a power of 2.
    """
    def __init__(self, layout, cd_from, cd_to, depth=32):
        self.sink    = sink   = stream.Endpoint(layout) # In `cd_from`.
        self.source  = source = stream.Endpoint(layout) # In `cd_to`.
        self.latency = None                             # Depends on both clocks.

        # # #

        # Pointers, one bit wider than an address: it tells full from empty.
        # ------------------------------------------------------------------
        bits    = log2_int(depth) + 1
        produce = ClockDomainsRenamer(cd_from)(GrayCounter(bits))
        consume = ClockDomainsRenamer(cd_to)(GrayCounter(bits))
        self.submodules += produce, consume
        produced, consumed = Signal(bits), Signal(bits) # As the other side sees them.
        self.specials += [
            MultiReg(produce.q, produced, cd_to),
            MultiReg(consume.q, consumed, cd_from),
        ]
        full = Signal()
        self.comb += [
            # `depth` apart: in Gray code the two highest bits differ, and no others.
            full.eq(produce.q == Cat(consumed[:-2], ~consumed[-2], ~consumed[-1])),
            sink.ready.eq(~full),
            produce.ce.eq(sink.valid & sink.ready),
            source.valid.eq(consume.q != produced),
            consume.ce.eq(source.valid & source.ready),
        ]

        # Memory.
        # -------
        items  = [Cat(*[getattr(endpoint, name) for name, *_ in layout], endpoint.last) for endpoint in (sink, source)]
        memory = Memory(len(items[0]), depth)
        write  = memory.get_port(write_capable=True, clock_domain=cd_from)
        read   = memory.get_port(async_read=True)
        self.specials += memory, write, read
        self.comb += [
            write.adr.eq(produce.q_binary[:-1]),
            write.dat_w.eq(items[0]),
            write.we.eq(produce.ce),
            read.adr.eq(consume.q_binary[:-1]),
            items[1].eq(read.dat_r),
        ]
