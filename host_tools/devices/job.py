#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One frame's way over a network: what stored and streamed ones share, from the request for a slot to its release."""

from __future__ import annotations

import abc
import time
from collections.abc import Collection
from typing import ClassVar

from ..core.errors import DeviceError, LinkTimeout
from ..link.link import Call
from ..protocol import payloads
from ..protocol.messages import ErrorCode, Message, MessageType
from ..protocol.payloads import FrameState, FrameStatus
from ..protocol.refusals import failed_frame, refusal
from .base import Progress, Result
from .udp.download import Download
from .udp.frame import Frame
from .udp.route import Route

#: The wait between two questions for the status in seconds: it grows from the first to the second.
MIN_POLL_S = 0.0005
_MAX_POLL_S = 0.05

#: Longest match in seconds, behind two others; a slow simulation of the largest frame takes a few.
_MATCH_LIMIT_S = 360.0

#: Tries to open a frame for which there is no slot, until it counts as true.
_OPEN_TRIES = 8


class Journey(abc.ABC):
    """A frame under way; replies move it on, and `step` sends what is to be sent.

    Parameters
    ----------
    former
        Frames that were released before: a late copy of the request that opened them may have done it again.
    """

    #: The request that takes a slot.
    OPENING: ClassVar[MessageType]

    def __init__(self, route: Route, frame: Frame, former: Collection[int], progress: Progress | None) -> None:
        self.frame     = frame
        self.released  = False
        self._route    = route
        self._link     = route.link
        self._former   = former
        self._progress = progress
        self._download: Download | None    = None
        self._status:   FrameStatus | None = None
        self._call:     Call | None        = None
        self._opens    = 0
        self._first    = False
        self._asking   = False
        self._matched  = False
        self._poll_s   = MIN_POLL_S
        self._poll_at  = 0.0
        self._looks    = 0
        self._open()

    @property
    @abc.abstractmethod
    def sent(self) -> bool:
        """Whether the next frame may be sent."""

    @property
    @abc.abstractmethod
    def feeding(self) -> bool:
        """Whether the matcher waits for pixels of this frame."""

    @property
    def arrived(self) -> bool:
        """Whether all of the map is here."""
        return self._matched and self._download is not None and self._download.done

    @property
    def wake_at(self) -> float:
        """When there is something to do, after a step, if nothing comes."""
        if self._first and self._matched and self._download is not None:
            return self._download.late_at
        return self._poll_at if self._asking and self._call is None else float("inf")

    def result(self) -> Result:
        """The frame's result, once the map is here."""
        if self._status is None:
            raise DeviceError(f"frame {self.frame.frame_id} has not been matched")
        return self.frame.result(self._status)

    def step(self, first: bool, due: bool) -> None:
        """Sends what is to be sent.

        Only the `first` frame under way is asked for its map. A frame is `due` when the matcher waits for no other.
        """
        self._first = first
        self._send()
        self._asking = not self._matched and self._is_worth_asking(due)
        if self._asking and self._call is None and time.monotonic() >= self._poll_at:
            self._ask_status()
        if first and self._matched:
            self._fetch()

    @abc.abstractmethod
    def _send(self) -> None:
        """Sends what the window allows of the pixels, and what has to follow them."""

    @abc.abstractmethod
    def _is_worth_asking(self, due: bool) -> bool:
        """Whether the frame's status may have changed."""

    def _fetch(self) -> None:
        download = self._download
        if download is None:
            download = self._download = Download(self._route, self.frame, self._progress)
            self.frame.download_at = time.monotonic()
        if not download.done:
            download.fill()
            # When no map comes, a question that is answered tells whether there still is a session.
            if download.stalled > self._looks and self._call is None:
                self._ask_status()
            self._looks = download.stalled
        elif not self.frame.downloaded_at:
            self.frame.downloaded_at = time.monotonic()
            self.forget()
            self._call = self._link.submit(MessageType.RELEASE, frame_id=self.frame.frame_id, urgent=True,
                                           on_reply=self._on_released)

    def _open(self) -> None:
        self._opens += 1
        size = payloads.pack_size(self.frame.width, self.frame.height)
        self._call = self._link.submit(self.OPENING, size, self.frame.frame_id, on_reply=self._on_opened,
                                       accepts=[ErrorCode.NO_SLOT])

    def _on_opened(self, reply: Message) -> None:
        if reply.type == MessageType.ERROR:
            if self._opens >= _OPEN_TRIES:
                raise refusal(reply)
            self._release_former()
            self._open()
            return
        self._call = None
        self._begin(reply)

    def _release_former(self) -> None:
        for frame_id in self._former:
            self._link.submit(MessageType.RELEASE, frame_id=frame_id, urgent=True)

    @abc.abstractmethod
    def _begin(self, reply: Message) -> None:
        """The frame has a slot."""

    def _ask_status(self) -> None:
        self._call = self._link.submit(MessageType.STATUS, frame_id=self.frame.frame_id, urgent=True,
                                       on_reply=self._on_status)

    def _on_status(self, reply: Message) -> None:
        self._call = None
        self._take_status(FrameStatus.unpack(reply.payload))
        self._poll_at = time.monotonic() + self._poll_s
        self._poll_s  = min(1.5*self._poll_s, _MAX_POLL_S)

    def _take_status(self, status: FrameStatus) -> None:
        now = time.monotonic()
        if status.state == FrameState.FAILED:
            self._fail(status)
        elif status.state not in (FrameState.READY, FrameState.MATCHING, FrameState.DONE):
            raise DeviceError(f"the device lost frame {self.frame.frame_id} (state {status.state}): connect again")
        elif status.state == FrameState.DONE and not self._matched:
            self._matched = True
            self._status  = status
            self.frame.matched_at = now
            if self._progress is not None:
                self._progress("match", 1, 1)
            self._on_matched()
        elif status.state != FrameState.DONE and now - self.frame.started_at > _MATCH_LIMIT_S:
            raise LinkTimeout(f"the device has not matched frame {self.frame.frame_id} within {_MATCH_LIMIT_S:g} s: "
                              "restart it")

    @abc.abstractmethod
    def _on_matched(self) -> None:
        """The map is in the device's memory."""

    def _fail(self, status: FrameStatus) -> None:
        """The device could not match the frame."""
        raise failed_frame(self.frame.frame_id, status.error)

    def _on_released(self, _: Message) -> None:
        self._call    = None
        self.released = True

    def forget(self) -> None:
        """Asks for nothing any more."""
        if self._call is not None:
            self._link.drop(self._call)
        if self._download is not None:
            self._download.forget()
