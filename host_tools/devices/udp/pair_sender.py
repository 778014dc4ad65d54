#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pixel pairs of a streamed frame to a device, which takes them in order only: behind a loss all goes once more."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from ...core.errors import LinkTimeout
from ...link.link import Call
from ...protocol.messages import CHUNK_BYTES, NO_OFFSET, Message, MessageType
from ...protocol.payloads import FrameState, FrameStatus
from ..base import Progress
from .frame import Frame
from .route import Route


@dataclass(frozen=True)
class _Batch:
    """Chunks that were sent one after the other, up to `end`, and the question after them."""

    round: int
    count: int
    end:   int
    call:  Call


class PairSender:
    """A frame's pairs on their way to the matcher, which has begun with it.

    Chunks go in batches, and after each a STATUS, whose reply tells which chunk the device wants next. If that is one
    of the batch, all from there on goes once more: a new round, in which replies to the batches before tell only how
    far the device has come.
    """

    def __init__(self, route: Route, frame: Frame, progress: Progress | None,
                 on_status: Callable[[FrameStatus], None]) -> None:
        self._link      = route.link
        self._channel   = route.channel
        self._window    = route.window
        self._frame     = frame
        self._progress  = progress
        self._on_status = on_status
        self._pairs     = frame.pairs()
        self._count     = -(-len(self._pairs) // CHUNK_BYTES)
        self._next      = 0
        self._taken     = 0
        self._tried     = 0
        self._round     = 0
        self._vain      = 0
        self._batches:  deque[_Batch] = deque()
        self._report()

    @property
    def done(self) -> bool:
        """Whether the device has all pairs."""
        return self._taken == self._count

    def fill(self) -> None:
        """Sends what the window allows."""
        while self._next < self._count and (count := self._window.take(self._count - self._next)):
            for index in range(self._next, self._next + count):
                offset = index*CHUNK_BYTES
                self._channel.send_chunk(self._link.session, self._link.next_sequence(), self._frame.frame_id, offset,
                                         self._pairs[offset:offset + CHUNK_BYTES], MessageType.PAIRS)
            new         = max(0, self._next + count - max(self._next, self._tried))
            self._next += count
            self._tried = max(self._tried, self._next)
            self._link.counters.chunks_sent       += new
            self._link.counters.chunks_sent_again += count - new
            self._ask(count)

    def _ask(self, count: int) -> None:
        call  = self._link.submit(MessageType.STATUS, frame_id=self._frame.frame_id, urgent=True)
        batch = _Batch(self._round, count, self._next, call)
        call.on_reply = lambda reply: self._told(batch, reply)
        self._batches.append(batch)
        self._link.flush()

    def _told(self, batch: _Batch, reply: Message) -> None:
        """Takes in how far the device has come, after a batch."""
        status = FrameStatus.unpack(reply.payload)
        while self._batches and self._batches[0] is not batch:
            self._end_batch()
        self._end_batch()
        self._on_status(status)
        if status.state not in (FrameState.MATCHING, FrameState.DONE):
            return
        wanted = self._count if status.first_missing == NO_OFFSET else status.first_missing // CHUNK_BYTES
        if wanted > self._taken:
            self._taken = min(wanted, self._count)
            self._vain  = 0
            self._report()
        if batch.round == self._round:
            lost = max(0, batch.end - self._taken)
            self._window.learn(batch.count, min(lost, batch.count))
            if lost > 0:
                self._go_back()
        self._next = max(self._next, self._taken)
        if self.done:
            self._end()

    def _go_back(self) -> None:
        self._round += 1
        self._vain  += 1
        self._next   = self._taken
        if self._vain >= self._link.max_tries:
            raise LinkTimeout("the device answers, but gets no images: does the network carry datagrams of 1052 bytes?")

    def _end(self) -> None:
        """The device has everything."""
        self._frame.uploaded_at = self._frame.uploaded_at or time.monotonic()
        self.forget()

    def _end_batch(self) -> None:
        self._link.drop(self._batches.popleft().call)
        self._window.give_back()

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("upload", self._taken, self._count)

    def forget(self) -> None:
        """Gives up what is under way."""
        while self._batches:
            self._end_batch()
