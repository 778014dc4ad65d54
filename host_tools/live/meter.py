#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rate and latency of a stream of frames."""

from __future__ import annotations

import time
from collections import deque

import numpy as np

#: Frames that the recent rate is taken over.
RECENT_FRAMES = 30


class Meter:
    """Rate and latency of a stream, from the moment that the meter is made."""

    def __init__(self) -> None:
        self._begin_s     = time.monotonic()
        self._ends_s      = deque[float]([self._begin_s], maxlen=RECENT_FRAMES + 1)
        self._latencies_s: list[float] = []

    def count(self, latency_s: float) -> None:
        """Count a frame that is finished now, and took `latency_s` seconds."""
        self._ends_s.append(time.monotonic())
        self._latencies_s.append(latency_s)

    @property
    def frames(self) -> int:
        """Number of frames so far."""
        return len(self._latencies_s)

    @property
    def recent_frames_per_s(self) -> float:
        """Frames per second over the last 30 frames, or over all of them if they are fewer; 0 before the first."""
        seconds = self._ends_s[-1] - self._ends_s[0]
        return (len(self._ends_s) - 1)/seconds if seconds > 0 else 0.0

    def summary(self) -> dict[str, float | int | None]:
        """Return number of frames, seconds, frames per second over all frames, and percentiles of the latency.

        Returns
        -------
        `frames`; `seconds` until the last frame was finished; `frames_per_s`, None before the first frame; and what
        `percentiles` returns.
        """
        seconds = self._ends_s[-1] - self._begin_s
        return {
            "frames":       self.frames,
            "seconds":      seconds,
            "frames_per_s": self.frames/seconds if self.frames and seconds > 0 else None,
            **percentiles(self._latencies_s),
        }


def percentiles(latencies_s: list[float]) -> dict[str, float | int | None]:
    """Return the latencies, in seconds, that 50, 95 and 99 percent of the frames do not exceed; None without frames."""
    return {f"latency_p{part}_s": float(np.percentile(latencies_s, part)) if latencies_s else None
            for part in (50, 95, 99)}
