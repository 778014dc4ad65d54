#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The frames of a stream, all stepped in one loop: while one is matched, others are sent and fetched."""

from __future__ import annotations

import time
from collections import deque

from .base import Pair, Progress, Result
from .job import FrameJob, FrameRequest, LinkContext

#: Longest wait for the link in seconds before all frames are stepped again.
_POLL_S = 0.05


class Pipeline:
    """The frames of one stream, first in first out.

    Parameters
    ----------
    context
        The link, and what its frames share.
    kind
        How frames are matched: stored first, or as their pixels come.
    streams
        The pipelines of all streams of the device; the caller adds this one, and removes it at its end.
    slots
        Number of frames that can be open in the device at once.
    progress
        Called with the steps of each frame.
    """

    def __init__(self, context: LinkContext, kind: type[FrameJob], streams: list[Pipeline], slots: int,
                 progress: Progress | None) -> None:
        self._context  = context
        self._link     = context.link
        self._kind     = kind
        self._streams  = streams
        self._depth    = max(1, min(slots, context.most_frames))
        self._progress = progress
        self._jobs:    deque[FrameJob] = deque()
        self._leaving: list[FrameJob]  = []

    @property
    def empty(self) -> bool:
        """Return whether no frame is in flight."""
        return not self._jobs

    @property
    def has_room(self) -> bool:
        """Return whether the next frame may be sent."""
        # A frame that is leaving may still have its slot.
        return len(self._jobs) + len(self._leaving) < self._depth and all(job.sent for job in self._jobs)

    @property
    def open_frames(self) -> list[int]:
        """Return the numbers of the frames that may be open in the device."""
        return [job.frame_id for job in (*self._jobs, *self._leaving)]

    def add(self, frame_id: int, pair: Pair, request: FrameRequest) -> None:
        """Start to send a frame."""
        job = self._kind(self._context, frame_id, pair, request, self._progress)
        job.start()
        self._jobs.append(job)

    def step(self) -> Result | None:
        """Step all frames, and wait for the link; return the result of the first frame if it is here."""
        self._step_others()
        first = self._jobs[0]
        for job in (*self._jobs, *self._leaving):
            job.step(job is first, self._is_due(job))
        if first.arrived:
            self._leaving.append(self._jobs.popleft())
            first.release()
            self._link.flush()
            return first.result()
        wake_at = min(job.wake_at for job in self._jobs)
        self._link.pump(max(0.0, min(_POLL_S, wake_at - time.monotonic())))
        self._forget_released()
        return None

    def _step_others(self) -> None:
        """Step the frames of the other streams too: a device that gets no pixels times out."""
        for other in self._streams:
            if other is not self:
                for job in (*other._jobs, *other._leaving):
                    job.step(False, other._is_due(job))

    def _is_due(self, job: FrameJob) -> bool:
        """Return whether the matcher waits for pixels of no other frame."""
        return not any(other.feeding for other in self._jobs if other is not job)

    def drain(self) -> None:
        """Wait until the device has released all frames that have been matched."""
        while self._leaving:
            self._link.pump(_POLL_S)
            self._forget_released()

    def _forget_released(self) -> None:
        self._context.former.extend(job.frame_id for job in self._leaving if job.released)
        self._leaving = [job for job in self._leaving if not job.released]

    def forget(self) -> None:
        """Request nothing any more, and ignore replies."""
        for job in (*self._jobs, *self._leaving):
            job.forget()
