#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One frame on its way through a remote device."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import ProtocolError
from ..link import Call
from ..protocol import CHUNK_BYTES, Message
from ..settings import MatcherSettings
from .base import Pair


class Frame:
    """The host's side of an open frame: sizes in pixels, times of its phases, and its map as far as it has come."""

    def __init__(self, frame_id: int, pair: Pair, settings: MatcherSettings) -> None:
        self.frame_id           = frame_id
        self.height, self.width = pair[0].shape
        self.settings           = settings
        self.uploads:             list[Call] = []
        self.opened_at          = time.monotonic()
        self.started_at         = 0.0
        self._images            = [image.tobytes() for image in pair]
        self._map               = bytearray(2*self.width*self.height)

    def chunks(self, pitch: int) -> Iterator[tuple[int, bytes]]:
        """Offset in the upload space and bytes of every chunk; the right image begins at `pitch`."""
        for base, image in zip((0, pitch), self._images, strict=True):
            for offset in range(0, len(image), CHUNK_BYTES):
                yield base + offset, image[offset:offset + CHUNK_BYTES]

    def reads(self) -> Iterator[tuple[int, int]]:
        """Offset in the download space and length in bytes of every part of the map."""
        for offset in range(0, len(self._map), CHUNK_BYTES):
            yield offset, min(CHUNK_BYTES, len(self._map) - offset)

    def store(self, length: int, done: Callable[[object], None] | None) -> Callable[[Message], None]:
        """What takes in the reply to a READ of `length` bytes, and then calls `done`."""

        def take(reply: Message) -> None:
            if len(reply.payload) != length:
                raise ProtocolError(f"the device sent {len(reply.payload)} bytes of the map instead of {length}")
            self._map[reply.offset:reply.offset + length] = reply.payload
            if done is not None:
                done(reply)

        return take

    def disparity(self) -> NDArray[np.int16]:
        """The map: int16, H x W, in sixteenths of a pixel."""
        return np.frombuffer(self._map, "<i2").astype(np.int16).reshape(self.height, self.width)
