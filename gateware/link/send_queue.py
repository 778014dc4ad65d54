#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

PAYLOAD_WORDS = 512 # Room for the payloads of two messages: one is sent while the next one is read.

# Send Queue ---------------------------------------------------------------------------------------

class SendQueue(LiteXModule):
    """Turn jobs into messages that wait to be sent, with their payloads read from memory.

    There are two jobs at a time: a `reply` is one message, a `burst` is any number of them, one per 1024 bytes begun. A
    reply goes before the next message of the burst.

    A message is offered once all of its payload is in the queue: the wire does not wait.

    It is reset with its clock domain alone.

    Parameters
    ----------
    reader : StreamReader
        Reader of memory, of 32-bit items, for this core alone.
    """
    def __init__(self, reader):
        self.job        = Record(job_layout())            # Taken over by `reply` or `burst`.
        self.reply      = Signal()                        # Begin a reply (pulse). Not while reply_busy.
        self.burst      = Signal()                        # Begin a burst (pulse). Not while burst_busy.
        self.abort      = Signal()                        # Give the burst up (pulse).
        self.reply_busy = Signal()                        # The payload of the reply has not been read.
        self.burst_busy = Signal()                        # Some payload of the burst has not been read.
        self.source     = stream.Endpoint(job_layout())   # Messages, `length` up to 1024.
        self.payload    = stream.Endpoint([("data", 32)]) # Their payloads, one after the other.
        self.latency    = None                            # Depends on memory.

        # # #

        self.reply_job = Record(job_layout(), name="reply_job") # The reply,
        self.burst_job = Record(job_layout(), name="burst_job") # and the part of the burst that has not been read.
        self.last      = Signal()                               # The next message of the burst is its last.
        self.aborted   = Signal()                               # The burst is to be given up,
        self.given_up  = Signal()                               # and is, as no message of it is being read.
        self.chosen    = Signal()                               # The message under way is 0: a reply, 1: of a burst.
        self.done      = Signal()                               # Its payload has been read (pulse).
        self.room      = Signal()                               # There is room for the payload of a message.

        self.add_jobs()
        self.add_payloads(reader)
        self.add_messages(reader)

    def add_jobs(self):
        """Take jobs over, and advance the burst by each message that has been read."""
        burst    = self.burst_job
        advance  = Signal() # The next message of the burst has been read.
        answered = Signal() # The reply has been read.
        self.comb += [
            self.last.eq(burst.length <= CHUNK_BYTES),
            answered.eq(self.done & ~self.chosen),
            advance.eq(self.done & self.chosen),
        ]
        self.sync += [
            If(answered,
                self.reply_busy.eq(0)
            ),
            If(advance,
                burst.offset.eq(burst.offset + CHUNK_BYTES),
                burst.base.eq(burst.base + CHUNK_BYTES),
                burst.length.eq(burst.length - CHUNK_BYTES)
            ),
            If(self.given_up | (advance & self.last),
                self.burst_busy.eq(0)
            ),
            If(self.abort & self.burst_busy,
                self.aborted.eq(1)
            ),
            If(self.reply & ~self.reply_busy,
                self.reply_job.eq(self.job),
                self.reply_busy.eq(1)
            ),
            If(self.burst & ~self.burst_busy,
                burst.eq(self.job),
                self.burst_busy.eq(1),
                self.aborted.eq(0)
            ),
        ]

    def add_payloads(self, reader):
        """Queue the payloads that are read."""
        self.fifo  = fifo  = stream.SyncFIFO([("data", 32)], PAYLOAD_WORDS, buffered=True)
        # The word comes late in its clock from block RAM.
        self.shown = shown = stream.Buffer([("data", 32)])
        self.comb += [
            reader.source.connect(fifo.sink, keep={"valid", "ready", "data"}),
            fifo.source.connect(shown.sink),
            shown.source.connect(self.payload),
        ]
        self.sync += self.room.eq(fifo.level <= PAYLOAD_WORDS - CHUNK_BYTES//4)

    def add_messages(self, reader):
        """Choose a message, wait for room, read its payload, offer it."""
        message      = Record(job_layout(), name="message")
        self.offered = offered = stream.Buffer(job_layout()) # One is sent while the next is read.
        self.comb += [
            offered.source.connect(self.source),
            [getattr(offered.sink, name).eq(getattr(message, name)) for name, *_ in job_layout()],
            reader.base.eq(message.base),
            reader.length.eq(message.length),
        ]
        self.fsm = fsm = FSM(reset_state="CHOOSE")
        fsm.act("CHOOSE",
            If(self.reply_busy,
                NextValue(self.chosen, 0),
                next_values(message, self.reply_job),
                NextState("ROOM")
            ).Elif(self.burst_busy,
                NextValue(self.chosen, 1),
                next_values(message, self.burst_job),
                If(~self.last,
                    NextValue(message.length, CHUNK_BYTES)
                ),
                # Given up between two messages.
                If(self.aborted,
                    self.given_up.eq(1)
                ).Else(
                    NextState("ROOM")
                )
            )
        )
        fsm.act("ROOM",
            # A burst that waits may be given up: the wire takes nothing while no host answers ARP for a peer.
            If(self.chosen & self.aborted,
                self.given_up.eq(1),
                NextState("CHOOSE")
            # By now the register `room` shows what the payload before has left.
            ).Elif(self.room,
                If(message.length == 0,
                    self.done.eq(1),
                    NextState("OFFER")
                ).Else(
                    reader.start.eq(1),
                    NextState("READ")
                )
            )
        )
        fsm.act("READ",
            If(reader.idle,
                self.done.eq(1),
                NextState("OFFER")
            )
        )
        fsm.act("OFFER",
            offered.sink.valid.eq(1),
            # A burst that was given up ends even while its last message, or a reply, waits to be sent.
            self.given_up.eq(self.burst_busy & self.aborted),
            If(offered.sink.ready,
                NextState("CHOOSE")
            )
        )

def next_values(target, source):
    """Return statements of an FSM that copy a job, field by field."""
    return [NextValue(getattr(target, name), getattr(source, name)) for name, *_ in job_layout()]
