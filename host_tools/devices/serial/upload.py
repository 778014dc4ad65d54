#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images of a frame to a device on a serial line: each chunk is a request with a reply."""

from __future__ import annotations

import time
from collections import deque

from ...link.link import Call, Link
from ...protocol.messages import Message, MessageType
from ..base import Progress
from ..job import Chunk

#: Most requests that are queued or in flight; more than the link's window holds.
MOST_CALLS = 64


class SerialUpload:
    """The images of an open frame on their way to the device.

    Parameters
    ----------
    link
        The link to the device.
    frame_id, chunks
        Number of the frame, and its images.
    progress
        Called with the steps of "upload".
    """

    def __init__(self, link: Link, frame_id: int, chunks: list[Chunk], progress: Progress | None) -> None:
        self.begun_at  = 0.0
        self.ended_at  = 0.0
        self._link     = link
        self._frame_id = frame_id
        self._progress = progress
        self._queue    = deque(chunks)
        self._count    = len(chunks)
        self._arrived  = 0
        self._calls:   deque[Call] = deque()
        self._report()

    @property
    def done(self) -> bool:
        """Return whether the device has all chunks."""
        return self._arrived == self._count

    @property
    def sent(self) -> bool:
        """Return whether the device has all chunks, so that the line is free for those of the next frame."""
        return self.done

    def fill(self) -> None:
        """Submit as many chunks as the link's window needs."""
        self.begun_at = self.begun_at or time.monotonic()
        while self._calls and self._calls[0].reply is not None:
            self._calls.popleft()
        while self._queue and len(self._calls) < MOST_CALLS:
            offset, chunk = self._queue.popleft()
            self._calls.append(self._link.submit(MessageType.UPLOAD, bytes(chunk), self._frame_id, offset,
                                                 on_reply=self._on_reply))

    def _on_reply(self, _: Message) -> None:
        self._arrived += 1
        self.ended_at  = time.monotonic()
        self._report()

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("upload", self._arrived, self._count)

    def forget(self) -> None:
        """Stop sending, and ignore replies."""
        self._queue.clear()
        while self._calls:
            self._link.drop(self._calls.popleft())
