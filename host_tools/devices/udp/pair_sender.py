#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pixel pairs of a streamed frame to a device, which takes them in order only: after a loss all are sent once more."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from ...core.errors import LinkTimeout
from ...link.link import Call, Link
from ...link.udp_channel import UdpChannel
from ...protocol.messages import CHUNK_BYTES, NO_OFFSET, Message, MessageType
from ...protocol.payloads import FrameState, FrameStatus
from ..base import Progress
from .upload import UploadWindow


@dataclass(frozen=True)
class _Batch:
    """Chunks that were sent one after the other, up to chunk `end`, and the request after them."""

    round: int
    count: int
    end:   int
    call:  Call


class PairSender:
    """A frame's pixel pairs on their way to the matcher, which waits for them.

    Chunks go in batches. After each batch the host sends STATUS, whose reply tells which chunk the device wants next.
    If that is one of the batch, all chunks from there on are sent once more: a new round, in which replies to earlier
    batches only tell how far the device has come.

    Parameters
    ----------
    link, channel, window
        The link, the channel below it, and how many chunks may be in flight.
    frame_id
        Number of the frame.
    pairs
        Left and right pixels alternating, in raster order.
    progress
        Called with the steps of "upload".
    on_status
        Called with each status of the frame.
    """

    def __init__(self, link: Link, channel: UdpChannel, window: UploadWindow, frame_id: int, pairs: memoryview,
                 progress: Progress | None, on_status: Callable[[FrameStatus], None]) -> None:
        self.begun_at   = time.monotonic()
        self.ended_at   = 0.0
        self._link      = link
        self._channel   = channel
        self._window    = window
        self._frame_id  = frame_id
        self._pairs     = pairs
        self._progress  = progress
        self._on_status = on_status
        self._count     = -(-len(pairs) // CHUNK_BYTES)
        self._next      = 0
        self._taken     = 0
        self._tried     = 0
        self._round     = 0
        self._fruitless = 0
        self._batches:  deque[_Batch] = deque()
        self._report()

    @property
    def done(self) -> bool:
        """Return whether the device has all pairs."""
        return self._taken == self._count

    @property
    def sent(self) -> bool:
        """Return True: the next frame may be queued as soon as this one is matched."""
        return True

    def fill(self) -> None:
        """Send what the window allows."""
        while self._next < self._count and (count := self._window.take(self._count - self._next)):
            for index in range(self._next, self._next + count):
                offset = index*CHUNK_BYTES
                self._channel.send_chunk(self._link.session, self._link.next_sequence(), self._frame_id, offset,
                                         self._pairs[offset:offset + CHUNK_BYTES], MessageType.PAIRS)
            new         = max(0, self._next + count - max(self._next, self._tried))
            self._next += count
            self._tried = max(self._tried, self._next)
            self._link.counters.chunks_sent       += new
            self._link.counters.chunks_sent_again += count - new
            call  = self._link.submit(MessageType.STATUS, frame_id=self._frame_id, urgent=True)
            batch = _Batch(self._round, count, self._next, call)
            call.on_reply = partial(self._on_reply, batch)
            self._batches.append(batch)
            self._link.flush()

    def _on_reply(self, batch: _Batch, reply: Message) -> None:
        """Handle the reply that tells how far the device has come, after a batch."""
        status = FrameStatus.unpack(reply.payload)
        while self._batches and self._batches[0] is not batch:
            self._end_batch()
        self._end_batch()
        self._on_status(status)
        if status.state not in (FrameState.MATCHING, FrameState.DONE):
            return
        wanted = self._count if status.first_missing == NO_OFFSET else status.first_missing // CHUNK_BYTES
        if wanted > self._taken:
            self._taken     = min(wanted, self._count)
            self._fruitless = 0
            self._report()
        if batch.round == self._round:
            lost = max(0, batch.end - self._taken)
            self._window.learn(batch.count, min(lost, batch.count))
            if lost > 0:
                self._go_back()
        self._next = max(self._next, self._taken)
        if self.done:
            self.ended_at = self.ended_at or time.monotonic()
            self.forget()

    def _go_back(self) -> None:
        """Begin a new round at the chunk that the device wants."""
        self._round     += 1
        self._fruitless += 1
        self._next       = self._taken
        if self._fruitless >= self._link.max_tries:
            raise LinkTimeout("the device answers, but gets no images: does the network carry datagrams of 1052 bytes?")

    def _end_batch(self) -> None:
        self._link.drop(self._batches.popleft().call)
        self._window.give_back()

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("upload", self._taken, self._count)

    def forget(self) -> None:
        """Stop sending, and ignore replies."""
        while self._batches:
            self._end_batch()
