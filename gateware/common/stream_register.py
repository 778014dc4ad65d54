#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

# Stream Register ----------------------------------------------------------------------------------

def add_register(module, source, sink, clock_domain="sys"):
    """Connect two streams, with a register for ready and then one for data between them.

    LiteX's Buffer has them in the other order. In this one, both ends see nothing but registers.
    """
    renamed = ClockDomainsRenamer(clock_domain)
    ready   = renamed(stream.PipeReady(source.description))
    data    = renamed(stream.PipeValid(source.description))
    module.submodules += ready, data
    module.comb += [
        source.connect(ready.sink),
        ready.source.connect(data.sink),
        data.source.connect(sink),
    ]

def join(module, source, sink, pipelined):
    """Connect two streams; with registers between them if `pipelined`."""
    if pipelined:
        add_register(module, source, sink)
    else:
        module.comb += source.connect(sink)
