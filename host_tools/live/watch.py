#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of a source through a device, one after the other: maps, depth, and how long it took."""

from __future__ import annotations

import itertools
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import Rectifier
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from ..data.sources import Shot, Source
from ..devices.base import Device, Pair, Result

#: Frames that the rate at present is taken of.
_RATE_FRAMES = 30


@dataclass(frozen=True, eq=False)
class Seen:
    """A matched shot.

    `shot` has the images that were matched, rectified if there is a calibration; `depth_m` is float32, H x W, in
    metres, nan where there is none, or None without a calibration. `latency_s` is the time from when the pair was
    taken until its map was here.
    """

    shot:      Shot
    result:    Result
    depth_m:   NDArray[np.float32] | None
    latency_s: float

    @property
    def density(self) -> float:
        """Part of the pixels that have a disparity, 0 to 1."""
        return float(np.mean(self.result.disparity > self.result.settings.invalid))


@dataclass(frozen=True)
class Matching:
    """What is done to each pair of a stream."""

    settings:  MatcherSettings
    speckle:   SpeckleFilter
    rectifier: Rectifier | None

    def finish(self, result: Result) -> Result:
        """The result without what was matched with a border, and without speckles."""
        disparity = result.disparity
        if self.rectifier is not None:
            disparity = self.rectifier.clean(disparity, self.settings)
        return replace(result, disparity=self.speckle.apply(disparity, self.settings))


def watch(device: Device, source: Source, matching: Matching, frames: int | None = None,
          stopped: Callable[[], bool] = lambda: False) -> Iterator[Seen]:
    """Matches the pairs of a source; a remote device gets the next pair while it matches the one before.

    Parameters
    ----------
    frames
        How many pairs at most, None for all.
    stopped
        Asked before each pair: if it is true no more are taken, and those under way are finished.

    Raises
    ------
    As `Device.stream`, `Source` and `Rectifier.rectify`.
    """
    waiting = deque[Shot]()

    def pairs() -> Iterator[Pair]:
        # What is stopped must not take another pair from a camera.
        shots = itertools.takewhile(lambda _: not stopped(), itertools.count())
        for _, shot in zip(shots if frames is None else itertools.islice(shots, frames), source, strict=False):
            if matching.rectifier is not None:
                left, right = matching.rectifier.rectify(*shot.pair)
                shot        = replace(shot, left=left, right=right)
            waiting.append(shot)
            yield shot.pair

    for matched in device.stream(pairs(), matching.settings):
        result = matching.finish(matched)
        shot   = waiting.popleft()
        depth  = None
        if matching.rectifier is not None:
            depth = matching.rectifier.depth_m(result.disparity, matching.settings)
        yield Seen(shot, result, depth, time.monotonic() - shot.taken_at_s)


class Meter:
    """Rate and latency of a stream."""

    def __init__(self) -> None:
        self._begin_s     = time.monotonic()
        self._ends        = deque[float]([self._begin_s], maxlen=_RATE_FRAMES + 1)
        self._latencies_s: list[float] = []

    def count(self, latency_s: float) -> None:
        """Takes in a frame that is through."""
        self._ends.append(time.monotonic())
        self._latencies_s.append(latency_s)

    @property
    def frames(self) -> int:
        """Frames so far."""
        return len(self._latencies_s)

    @property
    def frames_per_s(self) -> float:
        """Rate at present, over the last frames; 0 before the first."""
        seconds = self._ends[-1] - self._ends[0]
        return (len(self._ends) - 1)/seconds if seconds > 0 else 0.0

    def summary(self) -> dict[str, float | int | None]:
        """Frames, seconds, rate over all of them, and percentiles of the latency in seconds."""
        seconds = self._ends[-1] - self._begin_s
        return {
            "frames":       self.frames,
            "seconds":      seconds,
            "frames_per_s": self.frames/seconds if self.frames and seconds > 0 else None,
            **percentiles(self._latencies_s),
        }


def percentiles(latencies_s: list[float]) -> dict[str, float | int | None]:
    """Latency that 50, 95 and 99 percent of the frames do not exceed, in seconds; None without frames."""
    return {f"latency_p{part}_s": float(np.percentile(latencies_s, part)) if latencies_s else None
            for part in (50, 95, 99)}
