#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from litex.soc.interconnect import stream

from .crossing_reset import CrossingReset, GrayPointer

# Crossing -----------------------------------------------------------------------------------------

class Crossing(LiteXModule):
    """A stream from one clock domain to another.

    As LiteX's ClockDomainCrossing, but with the read address in a register, and distributed memory. On an ECP5 LiteX's
    looks up whether there is a word, moves the address and reads the memory in one clock, which is too slow for the
    125 MHz of a wire. Put a register after it.

    A reset of either domain empties it. It accepts nothing until both sides have agreed on that, which takes up to two
    dozen clocks of the slower one: see `CrossingReset`.

    Parameters
    ----------
    layout : list
        Payload of the stream.
    cd_from, cd_to : str
        Clock domains.
    depth : int
        Room in items, a power of 2.
    reset : CrossingReset, optional
        Of both domains, if crossings share one.
    """
    def __init__(self, layout, cd_from, cd_to, depth=32, reset=None):
        self.sink    = sink   = stream.Endpoint(layout) # In `cd_from`.
        self.source  = source = stream.Endpoint(layout) # In `cd_to`.
        self.empty   = Signal()                         # In `cd_from`: all items have left.
        self.latency = None                             # Depends on both clocks.

        # # #

        # Pointers, one bit wider than an address: it tells full from empty.
        # ------------------------------------------------------------------
        bits    = log2_int(depth) + 1
        produce = ClockDomainsRenamer(cd_from)(GrayPointer(bits))
        consume = ClockDomainsRenamer(cd_to)(GrayPointer(bits))
        self.submodules += produce, consume
        produced = Signal(bits) # The same, as the other side sees them.
        consumed = Signal(bits)
        self.specials += [
            MultiReg(produce.q, produced, cd_to),
            MultiReg(consume.q, consumed, cd_from),
        ]
        if reset is None:
            self.reset = reset = CrossingReset(cd_from, cd_to)
        full = Signal()
        self.comb += [
            produce.clear.eq(reset.clear[cd_from]),
            consume.clear.eq(reset.clear[cd_to]),
            # `depth` apart: in Gray code the two highest bits differ, and no others.
            full.eq(produce.q == Cat(consumed[:-2], ~consumed[-2], ~consumed[-1])),
            sink.ready.eq(~full & ~reset.blocked[cd_from]),
            self.empty.eq(produce.q == consumed),
            produce.ce.eq(sink.valid & sink.ready),
            source.valid.eq((consume.q != produced) & ~reset.blocked[cd_to]),
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
