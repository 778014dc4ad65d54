#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map of a frame, or an image, from a device on a serial line: each part is a READ with a reply."""

from __future__ import annotations

import time
from collections import deque

from ...core.errors import ProtocolError
from ...link.link import Call, Link
from ...protocol import payloads
from ...protocol.messages import CHUNK_BYTES, Message, MessageType
from ..base import Progress
from .upload import MOST_CALLS


class SerialDownload:
    """A matched frame's map or image on its way to the host; the link repeats what is lost, so it never stalls.

    Parameters
    ----------
    link
        The link to the device.
    frame_id, place
        Number of the frame, and offsets of the map or the image in its download space.
    progress
        Called with the steps of "download".
    """

    stalled = 0
    late_at = float("inf")

    def __init__(self, link: Link, frame_id: int, place: range, progress: Progress | None) -> None:
        self.data      = bytearray(len(place))
        self.begun_at  = time.monotonic()
        self._link     = link
        self._frame_id = frame_id
        self._place    = place
        self._progress = progress
        self._queue    = deque(place[::CHUNK_BYTES])
        self._count    = len(self._queue)
        self._arrived  = 0
        self._calls:   deque[Call] = deque()
        self._report()

    @property
    def done(self) -> bool:
        """Return whether all of it has come."""
        return self._arrived == self._count

    def fill(self) -> None:
        """Submit as many READs as the link's window needs."""
        while self._calls and self._calls[0].reply is not None:
            self._calls.popleft()
        while self._queue and len(self._calls) < MOST_CALLS:
            offset = self._queue.popleft()
            length = min(CHUNK_BYTES, self._place.stop - offset)
            # Urgent: they use the way from the device, while uploads use the way to it.
            self._calls.append(self._link.submit(MessageType.READ, payloads.pack_number(length), self._frame_id, offset,
                                                 reply_bytes=length, urgent=True, on_reply=self._on_part))

    def _on_part(self, reply: Message) -> None:
        begin  = reply.offset - self._place.start
        length = min(CHUNK_BYTES, len(self.data) - begin)
        if len(reply.payload) != length:
            raise ProtocolError(f"the device sent {len(reply.payload)} bytes of the map instead of {length}")
        self.data[begin:begin + length] = reply.payload
        self._arrived += 1
        self._report()

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("download", self._arrived, self._count)

    def forget(self) -> None:
        """Stop requesting, and ignore replies."""
        self._queue.clear()
        while self._calls:
            self._link.drop(self._calls.popleft())
