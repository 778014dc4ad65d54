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
    """Pass on the messages of two sources, in turns of one message while both have one.

    It is reset with its clock domain alone.
    """
    def __init__(self):
        self.sinks    = [stream.Endpoint(job_layout())   for _ in range(2)] # Messages of each source.
        self.payloads = [stream.Endpoint([("data", 32)]) for _ in range(2)] # Their payloads.
        self.source   = stream.Endpoint(job_layout())                       # Messages of both.
        self.payload  = stream.Endpoint([("data", 32)])                     # Their payloads.
        self.taken    = Signal(2)                                           # A bit for each: its message is being sent.
        self.latency  = None                                                # A message waits for its turn.

        # # #

        turn    = Signal() # Source of the message that is being sent, or was sent last.
        holding = Signal() # A message is being sent.
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
