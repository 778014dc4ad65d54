#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A stored frame's way: opened, uploaded to the device's memory, matched, downloaded, released."""

from __future__ import annotations

import time
from collections.abc import Collection
from typing import ClassVar

from ...protocol import payloads
from ...protocol.messages import Message, MessageType
from ..base import Progress
from ..job import Journey
from .frame import Frame
from .route import Route
from .upload import Upload


class StoredJourney(Journey):
    """A frame whose images stand in the device's memory before it is matched; see `Journey`."""

    OPENING: ClassVar[MessageType] = MessageType.OPEN

    def __init__(self, route: Route, frame: Frame, former: Collection[int], progress: Progress | None) -> None:
        self._upload: Upload | None = None
        self._started = False
        super().__init__(route, frame, former, progress)

    @property
    def sent(self) -> bool:
        """Whether all chunks have been sent, so that the next frame may be."""
        return self._upload is not None and self._upload.sent

    @property
    def feeding(self) -> bool:
        """Never: the matcher begins when all chunks are there."""
        return False

    def _send(self) -> None:
        if self._upload is not None and not self._started:
            self._upload.fill()
            if self._upload.done and self._call is None:
                self._start()

    def _is_worth_asking(self, due: bool) -> bool:
        return self._first and self._started

    def _begin(self, reply: Message) -> None:
        _, pitch     = payloads.unpack_opened(reply.payload)
        self._upload = Upload(self._route, self.frame, pitch, self._progress)

    def _start(self) -> None:
        self._call = self._link.submit(MessageType.START, frame_id=self.frame.frame_id, urgent=True,
                                       on_reply=self._on_started)
        self.frame.started_at = time.monotonic()

    def _on_started(self, _: Message) -> None:
        self._call    = None
        self._started = True
        if self._progress is not None:
            self._progress("match", 0, 1)

    def _on_matched(self) -> None:
        pass

    def forget(self) -> None:
        """Asks for nothing any more."""
        super().forget()
        if self._upload is not None:
            self._upload.forget()
