#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames to a remote device and disparity maps back."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable

from ...core.errors import DeviceError, LinkTimeout
from ...core.settings import MatcherSettings
from ...link.link import Link
from ...protocol import payloads
from ...protocol.messages import MessageType
from ...protocol.payloads import FrameState, FrameStatus
from ...protocol.refusals import failed_frame
from ..base import Progress, Result
from ..udp.frame import Frame

#: The wait between two questions for the status in seconds: it grows from the first to the second.
_MIN_POLL_S = 0.001
_MAX_POLL_S = 0.05

#: Longest match in seconds; a slow simulation of the largest frame takes a few.
_MATCH_LIMIT_S = 120.0


class Transfer:
    """The steps of a frame, in the order `begin_upload`, `finish_upload`, `collect`.

    Those of two frames may interleave. All raise DeviceError, or one of its children, if the device refuses,
    fails or does not answer.
    """

    def __init__(self, link: Link) -> None:
        self._link       = link
        self._configured: MatcherSettings | None = None

    def begin_upload(self, frame: Frame, progress: Progress | None) -> None:
        """Opens a frame and queues its upload."""
        if frame.settings != self._configured:
            self._link.call(MessageType.CONFIGURE, payloads.pack_parameters(frame.settings.parameters))
            self._configured = frame.settings
        size     = payloads.pack_size(frame.width, frame.height)
        _, pitch = payloads.unpack_opened(self._link.call(MessageType.OPEN, size, frame.frame_id).payload)
        chunks   = list(frame.chunks(pitch))
        done     = _steps("upload", len(chunks), progress)
        frame.uploads = [self._link.submit(MessageType.UPLOAD, bytes(chunk), frame.frame_id, offset, on_reply=done)
                         for offset, chunk in chunks]

    def finish_upload(self, frame: Frame) -> None:
        """Waits for the upload's end, and has the frame matched."""
        self._link.wait(frame.uploads)
        frame.started_at = time.monotonic()
        self._link.call(MessageType.START, frame_id=frame.frame_id)

    def collect(self, frame: Frame, progress: Progress | None) -> Result:
        """Waits for a frame's match, and fetches its map, while the link sends what else is queued."""
        if progress is not None:
            progress("match", 0, 1)
        status = self._wait_for_match(frame)
        if progress is not None:
            progress("match", 1, 1)
        frame.matched_at = frame.download_at = time.monotonic()
        reads = list(frame.reads())
        done  = _steps("download", len(reads), progress)
        self._link.wait([
            self._link.submit(MessageType.READ, payloads.pack_number(length), frame.frame_id, offset,
                              reply_bytes=length, urgent=True, on_reply=frame.store(length, done))
            for offset, length in reads])
        frame.downloaded_at = time.monotonic()
        self._link.call(MessageType.RELEASE, frame_id=frame.frame_id)
        return frame.result(status)

    def _wait_for_match(self, frame: Frame) -> FrameStatus:
        begin  = time.monotonic()
        poll_s = _MIN_POLL_S
        while True:
            reply  = self._link.call(MessageType.STATUS, frame_id=frame.frame_id)
            status = FrameStatus.unpack(reply.payload)
            if status.state == FrameState.DONE:
                return status
            if status.state == FrameState.FAILED:
                raise failed_frame(frame.frame_id, status.error)
            if status.state not in (FrameState.READY, FrameState.MATCHING):
                raise DeviceError(f"the device lost frame {frame.frame_id} (state {status.state}): "
                                  "connect again")
            if time.monotonic() - begin > _MATCH_LIMIT_S:
                raise LinkTimeout(f"the device has not matched frame {frame.frame_id} within "
                                  f"{_MATCH_LIMIT_S:g} s: restart it")
            self._link.idle(poll_s)
            poll_s = min(1.5*poll_s, _MAX_POLL_S)


def _steps(phase: str, total: int, progress: Progress | None) -> Callable[[object], None] | None:
    """A callback that counts the replies of one phase."""
    if progress is None:
        return None
    counter = itertools.count(1)
    progress(phase, 0, total)

    def step(_: object) -> None:
        progress(phase, next(counter), total)

    return step
