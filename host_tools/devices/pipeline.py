#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames under way over a network, all in one loop: while one is matched, others are sent and fetched."""

from __future__ import annotations

import time
from collections import deque

from .base import Progress, Result
from .job import Journey
from .udp.frame import Frame
from .udp.route import Route
from .udp.stored import StoredJourney
from .udp.streamed import StreamedJourney

#: One frame is sent, one matched and one fetched, and while they change places one is between two of these.
_MOST_FRAMES = 4

#: Longest wait for the network in seconds between two looks at what is to be done.
_LOOK_S = 0.05


class Pipeline:
    """The frames of one stream, first in first out.

    Parameters
    ----------
    slots
        Frames that can be open in the device at once.
    former
        Numbers of the last frames that were released, to which those of this stream are added.
    streamed
        Whether frames are matched as their pixels come.
    """

    def __init__(self, route: Route, slots: int, former: deque[int], progress: Progress | None,
                 streamed: bool) -> None:
        self._route     = route
        self._link      = route.link
        self._depth     = max(1, min(slots, _MOST_FRAMES))
        self._former    = former
        self._progress  = progress
        self._kind      = StreamedJourney if streamed else StoredJourney
        self._journeys: deque[Journey] = deque()
        self._leaving:  list[Journey] = []

    @property
    def empty(self) -> bool:
        """Whether no frame is under way."""
        return not self._journeys

    @property
    def has_room(self) -> bool:
        """Whether the next frame may be sent."""
        # A frame that is leaving may still have its slot.
        return (len(self._journeys) + len(self._leaving) < self._depth
                and all(journey.sent for journey in self._journeys))

    @property
    def open_frames(self) -> list[Frame]:
        """Frames that the device may hold."""
        return [journey.frame for journey in (*self._journeys, *self._leaving)]

    def add(self, frame: Frame) -> None:
        """Sets a frame on its way."""
        self._journeys.append(self._kind(self._route, frame, self._former, self._progress))

    def tend(self) -> None:
        """Goes on with what does not bear a wait while others are stepped: a matcher waits for pixels, and gives up."""
        self._step_all(None)

    def _step_all(self, first: Journey | None) -> None:
        for journey in (*self._journeys, *self._leaving):
            due = not any(other.feeding for other in self._journeys if other is not journey)
            journey.step(journey is first, due)

    def step(self) -> Result | None:
        """Does what is to be done, and waits for the network; returns the result of the first frame if it is here."""
        first = self._journeys[0]
        self._step_all(first)
        if first.arrived:
            self._leaving.append(self._journeys.popleft())
            first.step(True, True)
            self._link.flush()
            return first.result()
        wake_at = min(journey.wake_at for journey in self._journeys)
        self._link.pump(max(0.0, min(_LOOK_S, wake_at - time.monotonic())))
        self._leave()
        return None

    def drain(self) -> None:
        """Waits until the device has let go of all frames that are through."""
        while self._leaving:
            self._link.pump(_LOOK_S)
            self._leave()

    def _leave(self) -> None:
        self._former.extend(journey.frame.frame_id for journey in self._leaving if journey.released)
        self._leaving = [journey for journey in self._leaving if not journey.released]

    def forget(self) -> None:
        """Asks for nothing any more."""
        for journey in (*self._journeys, *self._leaving):
            journey.forget()
