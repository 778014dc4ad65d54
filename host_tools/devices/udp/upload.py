#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images of a frame to a device, in datagrams that nobody answers: only what is missing is asked for."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...core.errors import LinkTimeout, ProtocolError
from ...link.link import Call
from ...protocol.messages import Message, MessageType
from ..base import Progress
from .frame import Frame
from .route import Route

#: Number of the batch of a chunk that waits to be sent.
_WAITING = np.iinfo(np.int64).max


@dataclass(frozen=True)
class _Batch:
    """Chunks that were sent one after the other, and the question after them."""

    number: int
    count:  int
    call:   Call


class Upload:
    """An open frame's images on their way.

    Chunks go in batches, and after each a MISSING, whose reply tells which of the chunks sent before it did
    not arrive: they go first into the next batch. A reply to a later MISSING tells what an earlier one would.
    """

    def __init__(self, route: Route, frame: Frame, pitch: int, progress: Progress | None) -> None:
        self._link     = route.link
        self._channel  = route.channel
        self._window   = route.window
        self._frame    = frame
        self._progress = progress
        self._chunks   = list(frame.chunks(pitch))
        self._queue    = deque(range(len(self._chunks)))
        self._missing  = np.ones(len(self._chunks), bool)
        self._tried    = np.zeros(len(self._chunks), bool)
        self._sent_in  = np.full(len(self._chunks), _WAITING)
        self._begun    = 0
        self._batches: deque[_Batch] = deque()
        self._vain     = 0
        self._report()

    @property
    def done(self) -> bool:
        """Whether the device has all chunks."""
        return not self._missing.any()

    @property
    def sent(self) -> bool:
        """Whether no chunk waits to be sent."""
        return not self._queue

    def fill(self) -> None:
        """Sends what the window allows."""
        while self._queue and (count := self._window.take(len(self._queue))):
            self._begun += 1
            if self._begun == 1:
                self._frame.opened_at = time.monotonic()
            batch = [self._queue.popleft() for _ in range(count)]
            for index in batch:
                offset, chunk = self._chunks[index]
                self._channel.send_chunk(self._link.session, self._link.next_sequence(), self._frame.frame_id, offset,
                                         chunk)
            again = int(np.count_nonzero(self._tried[batch]))
            self._tried[batch]   = True
            self._sent_in[batch] = self._begun
            self._link.counters.chunks_sent       += count - again
            self._link.counters.chunks_sent_again += again
            self._ask(count)

    def _ask(self, count: int) -> None:
        number = self._begun
        call   = self._link.submit(MessageType.MISSING, frame_id=self._frame.frame_id, urgent=True,
                                   reply_bytes=-(-len(self._chunks) // 8),
                                   on_reply=lambda reply: self._told(number, reply))
        self._batches.append(_Batch(number, count, call))
        self._link.flush()

    def _told(self, number: int, reply: Message) -> None:
        """Takes in what the device says is missing of all up to batch `number`."""
        bits = np.unpackbits(np.frombuffer(reply.payload, np.uint8), bitorder="little")
        if len(bits) < len(self._missing):
            raise ProtocolError(f"the device told of {len(bits)} chunks of frame {self._frame.frame_id}, which has "
                                f"{len(self._missing)}")
        before         = np.count_nonzero(self._missing)
        self._missing &= bits[:len(self._missing)].astype(bool)
        self._vain     = self._vain + 1 if np.count_nonzero(self._missing) == before else 0
        if self._vain >= self._link.max_tries:
            raise LinkTimeout("the device answers, but gets no images: does the network carry datagrams of 1052 bytes?")

        lost = np.flatnonzero(self._missing & (self._sent_in <= number))
        self._sent_in[lost] = _WAITING
        self._queue.extendleft(lost[::-1].tolist())
        # One that waits to be sent again may have arrived late.
        while self._queue and not self._missing[self._queue[0]]:
            self._queue.popleft()
        self._end_batches(number, len(lost))
        self._report()
        if self.done:
            self._end_batches(self._begun, 0)
            self._queue.clear()

    def _end_batches(self, number: int, lost: int) -> None:
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
        """Gives up what is under way."""
        self._end_batches(self._begun, 0)
        self._queue.clear()
