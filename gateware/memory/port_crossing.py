#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common                 import *
from ..common.crossing        import Crossing
from ..common.crossing_reset  import CrossingReset
from ..common.pulse_crossing  import PulseCrossing
from ..common.stream_register import add_register
from .ports                   import MemoryReader, MemoryWriter, RemotePort, word_bytes

# Port Crossing ------------------------------------------------------------------------------------

class PortCrossing(RemotePort, LiteXModule):
    """A memory port for a core in another clock domain: addresses and words cross, not the port's handshake.

    To write, an address crosses together with its word, and the pulse `written` crosses back. A core that gives up its
    accesses, and waits for those under way, leaves nothing in the crossing. A reset has to reach both domains, as the
    memory is part of the one and the core of the other; but at different times, or while a clock is stopped.

    Parameters
    ----------
    port : wishbone.Interface or LiteDRAMNativePort
        Port in `sys`.
    mode : str
        "read" or "write".
    clock_domain : str
        Clock domain of the core.
    burst_bytes : int
        Bytes of a burst of the core.
    reset : CrossingReset, optional
        Of both domains, if crossings share one.
    """
    def __init__(self, port, mode, clock_domain, burst_bytes=128, reset=None):
        check(mode in ("read", "write"), f"mode must be read or write, not {mode}.")
        burst = max(4, burst_bytes//word_bytes(port))
        near  = (MemoryReader if mode == "read" else MemoryWriter)(port, fifo_depth=burst)
        if reset is None:
            self.reset = reset = CrossingReset("sys", clock_domain)
        self.near         = near
        self.clock_domain = clock_domain
        self.data_width   = port.data_width
        self.sink         = stream.Endpoint(near.sink.description) # Addresses, and to write their words.
        self.error        = self.add_pulse(near.error, 4*burst, reset) # Bus error (pulse).
        self.latency      = None                                   # Depends on memory and on both clocks.

        # # #

        self.requests = requests = Crossing(near.sink.description.payload_layout, clock_domain, "sys", 8, reset)
        add_register(self, requests.source, near.sink)
        if mode == "read":
            self.comb  += self.sink.connect(requests.sink)
            self.source = stream.Endpoint(near.source.description) # Words that were read.
            self.words  = words = Crossing(near.source.description.payload_layout, "sys", clock_domain, 16, reset)
            self.comb  += near.source.connect(words.sink)
            add_register(self, words.source, self.source, clock_domain)
        else:
            self.written = self.add_pulse(near.written, 2*burst, reset) # A word has reached memory (pulse).
            self.add_limit(requests, 2*burst)

    def add_pulse(self, pulse, most, reset):
        """Let a pulse cross to the core, `most` of them under way; return it as the core sees it."""
        crossing = PulseCrossing("sys", self.clock_domain, most, reset)
        self.submodules += crossing
        self.comb += crossing.i.eq(pulse)
        return crossing.o

    def add_limit(self, requests, most):
        """Let no more than `most` words be under way: the core counts that many, and the crossing would hold more."""
        under_way = Signal(max=most + 1)
        room      = Signal()
        taken     = Signal()
        self.comb += [
            room.eq(under_way != most),
            self.sink.connect(requests.sink, omit={"valid", "ready"}),
            requests.sink.valid.eq(self.sink.valid & room),
            self.sink.ready.eq(requests.sink.ready & room),
            taken.eq(requests.sink.valid & requests.sink.ready),
        ]
        sync  = getattr(self.sync, self.clock_domain)
        sync += under_way.eq(under_way + taken - self.written)
