#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

# Message Arbiter ----------------------------------------------------------------------------------

class MessageArbiter(LiteXModule):
    """Two sources of messages take turns, a message each if both have one."""
    def __init__(self):
        self.sinks    = [stream.Endpoint(job_layout())       for _ in range(2)] # Messages.
        self.payloads = [stream.Endpoint([("data", 32)])     for _ in range(2)] # Their payloads.
        self.source   = stream.Endpoint(job_layout())
        self.payload  = stream.Endpoint([("data", 32)])
        self.taken    = Signal(2)                                               # Whose message is under way: a bit each.

        # # #

        turn    = Signal() # Whose message is under way, or was.
        holding = Signal()
        self.comb += [
            Case(turn, {n: [
                If(holding,
                    self.sinks[n].connect(self.source),
                    self.payloads[n].connect(self.payload)
                ),
                self.taken[n].eq(holding),
            ] for n in range(2)}),
        ]
        self.sync += [
            If(~holding,
                If(Mux(turn, self.sinks[0].valid, self.sinks[1].valid),
                    turn.eq(~turn),
                    holding.eq(1)
                ).Elif(Mux(turn, self.sinks[1].valid, self.sinks[0].valid),
                    holding.eq(1)
                )
            ),
            If(self.source.valid & self.source.ready,
                holding.eq(0)
            ),
        ]
