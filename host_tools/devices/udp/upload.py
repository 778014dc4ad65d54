#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images of a frame to a device, in datagrams without a reply: the host asks which of them are missing."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.errors import LinkTimeout, ProtocolError
from ...link.link import Call, Link
from ...link.udp_channel import UdpChannel
from ...protocol.messages import Message, MessageType
from ..base import Progress
from ..job import Chunk

#: Most batches in flight. Each ends with a request; a device keeps 8 of these waiting, those for maps included.
_MOST_BATCHES = 3

#: Chunks of a batch. All that are in flight fit the buffers of any system, and keep a wire of 1 Gbit/s busy. The larger
#: the batches are, the more of the wire a device gets whose CPU is slow to answer.
_SMALLEST_BATCH = 4
_FIRST_BATCH    = 16
_LARGEST_BATCH  = 48

#: Share of lost chunks above which a batch was too large.
_LOSSY = 0.125

#: Number of the batch of a chunk that waits to be sent.
_WAITING = np.iinfo(np.int64).max


class UploadWindow:
    """How many chunks of all frames may be in flight; it adapts to what the network has been able to carry."""

    def __init__(self) -> None:
        self.batch    = _FIRST_BATCH
        self._batches = 0

    def take(self, wanted: int) -> int:
        """Return how many chunks, at most `wanted`, may be sent now as a batch; 0 means wait until some arrive."""
        if self._batches >= _MOST_BATCHES:
            return 0
        self._batches += 1
        return min(wanted, self.batch)

    def give_back(self) -> None:
        """Make room: a batch is no longer in flight."""
        self._batches -= 1

    def learn(self, count: int, lost: int) -> None:
        """Adapt to the reply to a batch of `count` chunks, of which `lost` did not arrive."""
        if lost > _LOSSY*count:
            self.batch = max(_SMALLEST_BATCH, self.batch // 2)
        elif lost == 0:
            self.batch = min(_LARGEST_BATCH, self.batch + 2)


@dataclass(frozen=True)
class _Batch:
    """Chunks that were sent one after the other, and the request after them."""

    number: int
    count:  int
    call:   Call


class UdpUpload:
    """The images of an open frame on their way to the device.

    Chunks go in batches. After each batch the host sends MISSING, whose reply tells which of the chunks sent before it
    have not arrived: they go first in the next batch. A reply to a later MISSING also answers the earlier ones.
    """

    def __init__(self, link: Link, channel: UdpChannel, window: UploadWindow, frame_id: int, chunks: list[Chunk],
                 progress: Progress | None) -> None:
        self.begun_at   = 0.0
        self.ended_at   = 0.0
        self._link      = link
        self._channel   = channel
        self._window    = window
        self._frame_id  = frame_id
        self._chunks    = chunks
        self._progress  = progress
        self._queue     = deque(range(len(chunks)))
        self._missing   = np.ones(len(chunks), bool)
        self._tried     = np.zeros(len(chunks), bool)
        self._sent_in   = np.full(len(chunks), _WAITING)
        self._number    = 0
        self._batches:  deque[_Batch] = deque()
        self._fruitless = 0
        self._report()

    @property
    def done(self) -> bool:
        """Return whether the device has all chunks."""
        return not self._missing.any()

    @property
    def sent(self) -> bool:
        """Return whether no chunk waits to be sent."""
        return not self._queue

    def fill(self) -> None:
        """Send what the window allows."""
        while self._queue and (count := self._window.take(len(self._queue))):
            self.begun_at = self.begun_at or time.monotonic()
            self._number += 1
            batch = [self._queue.popleft() for _ in range(count)]
            for index in batch:
                offset, chunk = self._chunks[index]
                self._channel.send_chunk(self._link.session, self._link.next_sequence(), self._frame_id, offset, chunk)
            again = int(np.count_nonzero(self._tried[batch]))
            self._tried[batch]   = True
            self._sent_in[batch] = self._number
            self._link.counters.chunks_sent       += count - again
            self._link.counters.chunks_sent_again += again
            call = self._link.submit(MessageType.MISSING, frame_id=self._frame_id, urgent=True,
                                     reply_bytes=-(-len(self._chunks) // 8),
                                     on_reply=partial(self._on_missing, self._number))
            self._batches.append(_Batch(self._number, count, call))
            self._link.flush()

    def _on_missing(self, number: int, reply: Message) -> None:
        """Handle the reply that tells what is missing of all batches up to `number`."""
        bits = np.unpackbits(np.frombuffer(reply.payload, np.uint8), bitorder="little")
        if len(bits) < len(self._missing):
            raise ProtocolError(f"the device reported {len(bits)} chunks of frame {self._frame_id}, which has "
                                f"{len(self._missing)}")
        before          = np.count_nonzero(self._missing)
        self._missing  &= bits[:len(self._missing)].astype(bool)
        self._fruitless = self._fruitless + 1 if np.count_nonzero(self._missing) == before else 0
        if self._fruitless >= self._link.max_tries:
            raise LinkTimeout("the device answers, but gets no images: does the network carry datagrams of 1052 bytes?")

        lost = np.flatnonzero(self._missing & (self._sent_in <= number))
        self._sent_in[lost] = _WAITING
        self._queue.extendleft(lost[::-1].tolist())
        # A chunk that waits to be sent again may have arrived late.
        while self._queue and not self._missing[self._queue[0]]:
            self._queue.popleft()
        self._end_batches(number, len(lost))
        self._report()
        if self.done:
            self.ended_at = time.monotonic()
            self.forget()

    def _end_batches(self, number: int, lost: int) -> None:
        """End the batches up to `number`, whose own chunks include `lost` ones."""
        while self._batches and self._batches[0].number <= number:
            batch = self._batches.popleft()
            self._window.give_back()
            self._link.drop(batch.call)
            if batch.number == number:
                self._window.learn(batch.count, lost)

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("upload", int(np.count_nonzero(~self._missing)), len(self._missing))

    def forget(self) -> None:
        """Stop sending, and ignore replies."""
        # As if without a loss: the window learns nothing bad from what is given up.
        self._end_batches(self._number, 0)
        self._queue.clear()
