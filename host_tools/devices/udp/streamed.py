#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A streamed frame's way: in line for the matcher at once, and matched while its pixels come and its map goes."""

from __future__ import annotations

import time
from collections.abc import Collection
from typing import ClassVar

from ...protocol.messages import ErrorCode, Message, MessageType
from ...protocol.payloads import FrameState, FrameStatus
from ..base import Progress
from ..job import MIN_POLL_S, Journey
from .download import Download
from .frame import Frame
from .pair_sender import PairSender
from .route import Route

#: Questions for the status without a wait between them, when a frame may begin at any moment.
_CLOSE_POLLS = 16

#: Seconds in line behind nothing, after which something that was released is taken for the reason.
_READY_LIMIT_S = 0.5

#: Whoever takes the results may take his time, and a device does not wait for pixels for ever. A frame is begun again
#: if it was not stepped for so many seconds; the device waits for longer.
_AWAY_S = 1.0


class StreamedJourney(Journey):
    """A frame whose pixels go from the wire to the matcher; see `Journey`."""

    OPENING: ClassVar[MessageType] = MessageType.STREAM

    def __init__(self, route: Route, frame: Frame, former: Collection[int], progress: Progress | None) -> None:
        self._sender: PairSender | None = None
        self._opened     = False
        self._polls      = 0
        self._ready_at   = 0.0
        self._stepped_at = time.monotonic()
        self._was_away   = False
        super().__init__(route, frame, former, progress)

    @property
    def sent(self) -> bool:
        """Whether the frame is being matched, so that the next one may stand in line."""
        return self._sender is not None

    @property
    def feeding(self) -> bool:
        """Whether the matcher has begun, and pairs are missing."""
        return self._sender is not None and not self._sender.done

    def _open(self) -> None:
        # Before anything is sent: whoever is told of the progress may have had enough.
        if self._download is None:
            self._download = Download(self._route, self.frame, self._progress, live=True)
        super()._open()
        if self._call is not None:
            self._download.listen(self._call.request.sequence)

    def _begin(self, reply: Message) -> None:
        self._opened  = True
        self._polls   = 0
        self._poll_s  = 0.0
        self._poll_at = self._ready_at = self.frame.started_at = time.monotonic()

    def _send(self) -> None:
        now = time.monotonic()
        self._was_away   = self._was_away or now - self._stepped_at > _AWAY_S
        self._stepped_at = now
        if self._sender is not None and not self._sender.done:
            self._sender.fill()

    def _is_worth_asking(self, due: bool) -> bool:
        if self._sender is None:
            return self._opened and due
        # While pairs are sent the sender asks.
        return self._first and self._sender.done

    def _on_status(self, reply: Message) -> None:
        self._polls += 1
        if self._polls == _CLOSE_POLLS:
            self._poll_s = MIN_POLL_S
        super()._on_status(reply)

    def _take_status(self, status: FrameStatus) -> None:
        if not self._opened:
            return
        super()._take_status(status)
        now = time.monotonic()
        if status.state == FrameState.READY and self._first and now - self._ready_at > _READY_LIMIT_S:
            self._ready_at = now
            self._release_former()
        if status.state == FrameState.MATCHING and self._sender is None:
            self.frame.opened_at = self.frame.started_at = now
            if self._progress is not None:
                self._progress("match", 0, 1)
            self._sender = PairSender(self._route, self.frame, self._progress, self._take_status)

    def _on_matched(self) -> None:
        self.frame.download_at = self.frame.download_at or self.frame.matched_at
        if self._download is not None:
            self._download.settle()

    def _fail(self, status: FrameStatus) -> None:
        done = self._sender is not None and self._sender.done
        if status.error != ErrorCode.TIMEOUT or done or not self._was_away:
            super()._fail(status)
        # The device waited in vain for pairs, and rightly gave up.
        self.forget()
        self._sender   = None
        self._download = None
        self._opened   = self._was_away = False
        self._opens    = 0
        self._call     = self._link.submit(MessageType.RELEASE, frame_id=self.frame.frame_id, urgent=True,
                                           on_reply=lambda _: self._open())

    def forget(self) -> None:
        """Asks for nothing any more."""
        super().forget()
        if self._sender is not None:
            self._sender.forget()
