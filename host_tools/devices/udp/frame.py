#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One frame on its way through a remote device."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from ...core.errors import ProtocolError
from ...core.settings import MatcherSettings
from ...link.link import Call
from ...protocol.messages import CHUNK_BYTES, Message
from ...protocol.payloads import FrameStatus
from ..base import Pair, Result


class Frame:
    """The host's side of an open frame: size in pixels, times of its phases, the map as it comes.

    The phases of a stored frame follow one another; `uploaded_at` stays 0, as the match begins then. Those of a
    streamed one overlap.
    """

    def __init__(self, frame_id: int, pair: Pair, settings: MatcherSettings) -> None:
        self.frame_id           = frame_id
        self.height, self.width = pair[0].shape
        self.settings           = settings
        self.uploads:             list[Call] = []
        self.opened_at          = time.monotonic()
        self.uploaded_at        = 0.0
        self.started_at         = 0.0
        self.matched_at         = 0.0
        self.download_at        = 0.0
        self.downloaded_at      = 0.0
        # Copies: whoever streams may fill the same arrays with the next pair.
        self._images            = [memoryview(image.tobytes()) for image in pair]
        self._map               = bytearray(2*self.width*self.height)

    @property
    def map_bytes(self) -> int:
        """Size of the download space in bytes."""
        return len(self._map)

    def store_part(self, offset: int, part: bytes) -> None:
        """Puts a part of the map in its place."""
        self._map[offset:offset + len(part)] = part

    def chunks(self, pitch: int) -> Iterator[tuple[int, memoryview]]:
        """Offset in the upload space and bytes of every chunk; the right image begins at `pitch`."""
        for base, image in zip((0, pitch), self._images, strict=True):
            for offset in range(0, len(image), CHUNK_BYTES):
                yield base + offset, image[offset:offset + CHUNK_BYTES]

    def pairs(self) -> memoryview:
        """The pixels as a streamed frame has them: left and right alternating, raster order."""
        both       = np.empty((self.width*self.height, 2), np.uint8)
        both[:, 0] = np.frombuffer(self._images[0], np.uint8)
        both[:, 1] = np.frombuffer(self._images[1], np.uint8)
        return both.reshape(-1).data

    def reads(self) -> Iterator[tuple[int, int]]:
        """Offset in the download space and length in bytes of every part of the map."""
        for offset in range(0, len(self._map), CHUNK_BYTES):
            yield offset, min(CHUNK_BYTES, len(self._map) - offset)

    def store(self, length: int, done: Callable[[object], None] | None) -> Callable[[Message], None]:
        """What takes in the reply to a READ of `length` bytes, and then calls `done`."""

        def take(reply: Message) -> None:
            if len(reply.payload) != length:
                raise ProtocolError(f"the device sent {len(reply.payload)} bytes of the map "
                                    f"instead of {length}")
            self.store_part(reply.offset, reply.payload)
            if done is not None:
                done(reply)

        return take

    def result(self, status: FrameStatus) -> Result:
        """The frame's result, once all of the map has come."""
        disparity = np.frombuffer(self._map, "<i2").astype(np.int16)
        return Result(
            disparity        = disparity.reshape(self.height, self.width),
            settings         = self.settings,
            clocks           = status.clocks,
            first_row_clocks = status.first_row_clocks,
            upload_s         = (self.uploaded_at or self.started_at) - self.opened_at,
            match_s          = self.matched_at - self.started_at,
            download_s       = self.downloaded_at - self.download_at,
        )
