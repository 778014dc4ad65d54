#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A streamed frame on its way: queued for the matcher at once, and matched while pixels come and the map leaves."""

from __future__ import annotations

import time
from typing import ClassVar

import numpy as np

from ...protocol.messages import ErrorCode, Message, MessageType
from ...protocol.payloads import FrameState, FrameStatus
from ..base import Pair, Progress
from ..job import MIN_POLL_S, FrameJob, FrameRequest
from .context import UdpContext
from .download import UdpDownload
from .pair_sender import PairSender

#: Number of polls for the status without a wait between them, as the matcher may begin with the frame at any moment.
_CLOSE_POLLS = 16

#: If the first frame is still READY after so many seconds, a late copy has reopened a released frame: release those
#: again.
_READY_LIMIT_S = 0.5

#: Longest pause between two steps in seconds, shorter than a device waits for pixels: after a longer one a TIMEOUT is
#: the caller's, and the frame begins anew.
_AWAY_S = 1.0


class StreamedFrameJob(FrameJob):
    """A frame whose pixels go from the wire to the matcher; see `FrameJob`."""

    OPENING: ClassVar[MessageType] = MessageType.STREAM

    _context:  UdpContext
    _upload:   PairSender | None
    _download: UdpDownload | None

    def __init__(self, context: UdpContext, frame_id: int, pair: Pair, request: FrameRequest,
                 progress: Progress | None) -> None:
        super().__init__(context, frame_id, pair, request, progress)
        self._opened     = False
        self._polls      = 0
        self._ready_at   = 0.0
        self._stepped_at = time.monotonic()
        self._was_away   = False

    @property
    def sent(self) -> bool:
        """Return whether the frame is being matched, so that the next one may be queued."""
        return self._upload is not None

    @property
    def feeding(self) -> bool:
        """Return whether the matcher has begun with the frame, and pairs are missing."""
        return self._upload is not None and not self._upload.done

    def start(self) -> None:
        """Request a slot for the frame, in which it is queued for the matcher."""
        # The progress callback may raise: call it before anything is sent.
        if self._download is None:
            self._download = self._context.download(self.frame_id, self.map_bytes, self._progress, live=True)
        super().start()
        if self._call is not None:
            self._download.listen(self._call.request.sequence)

    def _on_opened(self, reply: Message) -> None:
        self._opened  = True
        self._polls   = 0
        self._poll_s  = 0.0
        self._poll_at = self._ready_at = self._started_at = time.monotonic()

    def _advance(self) -> None:
        now = time.monotonic()
        self._was_away   = self._was_away or now - self._stepped_at > _AWAY_S
        self._stepped_at = now

    def _may_change(self, due: bool) -> bool:
        if self._upload is None:
            return self._opened and due
        # While pairs are sent, the sender asks for the status.
        return self._first and self._upload.done

    def _on_status(self, reply: Message) -> None:
        self._polls += 1
        if self._polls == _CLOSE_POLLS:
            self._poll_s = MIN_POLL_S
        super()._on_status(reply)

    def _handle_status(self, status: FrameStatus) -> None:
        if not self._opened:
            return
        super()._handle_status(status)
        now = time.monotonic()
        if status.state == FrameState.READY and self._first and now - self._ready_at > _READY_LIMIT_S:
            self._ready_at = now
            self._release_former()
        if status.state == FrameState.MATCHING and self._upload is None:
            self._started_at = now
            if self._progress is not None:
                self._progress("match", 0, 1)
            self._upload = PairSender(self._link, self._context.channel, self._context.window, self.frame_id,
                                      self._pairs(), self._progress, self._handle_status)

    def _pairs(self) -> memoryview:
        """Return the pixels, left and right alternating, in raster order."""
        both       = np.empty((self.width*self.height, 2), np.uint8)
        both[:, 0] = np.frombuffer(self._sent[0], np.uint8)
        both[:, 1] = np.frombuffer(self._sent[1], np.uint8)
        return both.reshape(-1).data

    def _on_matched(self) -> None:
        if self._download is not None:
            self._download.settle()

    def _fail(self, status: FrameStatus) -> None:
        done = self._upload is not None and self._upload.done
        if status.error != ErrorCode.TIMEOUT or done or not self._was_away:
            super()._fail(status)
        # The device gave up while the caller was away: begin anew.
        self.forget()
        self._upload   = None
        self._download = None
        self._opened   = self._was_away = False
        self._opens    = 0
        self._call     = self._link.submit(MessageType.RELEASE, frame_id=self.frame_id, urgent=True,
                                           on_reply=lambda _: self.start())
