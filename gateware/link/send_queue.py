#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

PAYLOAD_WORDS = 512 # Room for the payloads of two messages: one is sent while the next is read.

# Send Queue ---------------------------------------------------------------------------------------

class SendQueue(LiteXModule):
    """Turn jobs into messages that wait to be sent, with their payloads read from memory.

    There are two jobs at a time: a `reply` is one message, a `run` any number, one per 1024 bytes begun. A reply goes before
    the next message of the run.

    A message is offered when all of its payload is there: the wire does not wait.

    Parameters
    ----------
    reader : StreamReader
        Way to memory, of 32-bit items; nobody else uses it.
    """
    def __init__(self, reader):
        self.job        = Record(job_layout())              # Taken over by `reply` or `run`.
        self.reply      = Signal()                          # Begin a reply (pulse). Not while reply_busy.
        self.run        = Signal()                          # Begin a run (pulse). Not while run_busy.
        self.abort      = Signal()                          # Give the run up (pulse).
        self.reply_busy = Signal()                          # Its payload has not been read.
        self.run_busy   = Signal()                          # Likewise, of all its messages.
        self.source     = stream.Endpoint(job_layout())     # Messages, `length` up to 1024.
        self.payload    = stream.Endpoint([("data", 32)])   # Their payloads, one behind the other.

        # # #

        # Jobs.
        # -----
        reply    = Record(job_layout(), name="reply_job")
        run      = Record(job_layout(), name="run_job")
        aborted  = Signal()
        given_up = Signal() # The run, at a place where it can be.
        advance  = Signal() # The run's next message has been read.
        answered = Signal() # The reply has.
        last     = Signal()
        self.comb += last.eq(run.length <= CHUNK_BYTES)
        self.sync += [
            If(answered,
                self.reply_busy.eq(0)
            ),
            If(advance,
                run.offset.eq(run.offset + CHUNK_BYTES),
                run.base.eq(run.base + CHUNK_BYTES),
                run.length.eq(run.length - CHUNK_BYTES)
            ),
            If(given_up | (advance & last),
                self.run_busy.eq(0)
            ),
            If(self.abort & self.run_busy,
                aborted.eq(1)
            ),
            If(self.reply & ~self.reply_busy,
                reply.eq(self.job),
                self.reply_busy.eq(1)
            ),
            If(self.run & ~self.run_busy,
                run.eq(self.job),
                self.run_busy.eq(1),
                aborted.eq(0)
            ),
        ]

        # Payloads.
        # ---------
        self.fifo = fifo = stream.SyncFIFO([("data", 32)], PAYLOAD_WORDS, buffered=True)
        self.comb += [
            reader.source.connect(fifo.sink, keep={"valid", "ready", "data"}),
            fifo.source.connect(self.payload),
        ]
        room = Signal()
        self.sync += room.eq(fifo.level <= PAYLOAD_WORDS - CHUNK_BYTES//4)

        # Messages: choose, read, offer.
        # ------------------------------
        message = Record(job_layout(), name="message")
        chosen  = Signal() # 1: the run's.
        done    = Signal() # Its payload has been read.
        self.offered = offered = stream.Buffer(job_layout()) # One is sent while the next is read.
        self.comb += [
            offered.source.connect(self.source),
            [getattr(offered.sink, name).eq(getattr(message, name)) for name, *_ in job_layout()],
            reader.base.eq(message.base),
            reader.length.eq(message.length),
            answered.eq(done & ~chosen),
            advance.eq(done & chosen),
        ]
        self.fsm = fsm = FSM(reset_state="CHOOSE")
        fsm.act("CHOOSE",
            If(self.reply_busy,
                NextValue(chosen, 0),
                *[NextValue(getattr(message, name), getattr(reply, name)) for name, *_ in job_layout()],
                NextState("ROOM")
            ).Elif(self.run_busy,
                NextValue(chosen, 1),
                *[NextValue(getattr(message, name), getattr(run, name)) for name, *_ in job_layout()],
                If(~last,
                    NextValue(message.length, CHUNK_BYTES)
                ),
                # Given up between two messages.
                If(aborted,
                    given_up.eq(1)
                ).Else(
                    NextState("ROOM")
                )
            )
        )
        fsm.act("ROOM",
            # A run that waits may be given up: the wire takes nothing while nobody answers ARP for a peer.
            If(chosen & aborted,
                given_up.eq(1),
                NextState("CHOOSE")
            # By now the register `room` has seen the payload before.
            ).Elif(room,
                If(message.length == 0,
                    done.eq(1),
                    NextState("OFFER")
                ).Else(
                    reader.start.eq(1),
                    NextState("READ")
                )
            )
        )
        fsm.act("READ",
            If(reader.idle,
                done.eq(1),
                NextState("OFFER")
            )
        )
        fsm.act("OFFER",
            offered.sink.valid.eq(1),
            # The run behind it need not wait with it.
            given_up.eq(self.run_busy & aborted),
            If(offered.sink.ready,
                NextState("CHOOSE")
            )
        )
