#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matches the pairs of a source one after the other: maps, depth, and the latency of each."""

from __future__ import annotations

import itertools
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import Rectifier
from ..core.images import valid_percent
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from ..data.sources import Shot, Source
from ..devices.base import Device, Pair, Result


@dataclass(frozen=True, eq=False)
class MatchedShot:
    """A shot and its map.

    Parameters
    ----------
    shot
        The images that were matched: rectified if there is a calibration.
    result
        The map, after rectification's mask and the speckle filter, and how it was matched.
    depth_m
        float32, H x W, in metres, nan where there is none; None without a calibration.
    latency_s
        Time from taking the pair until its map was here, in seconds.
    """

    shot:      Shot
    result:    Result
    depth_m:   NDArray[np.float32] | None
    latency_s: float

    @property
    def valid_of_all(self) -> float:
        """Pixels that have a disparity, in percent of all pixels of the map."""
        return valid_percent(self.result.disparity, self.result.settings.invalid)


@dataclass(frozen=True)
class Matching:
    """What is done to each pair of a stream: rectification if there is a calibration, the match, the speckle filter."""

    settings:  MatcherSettings
    speckle:   SpeckleFilter
    rectifier: Rectifier | None

    def finish(self, result: Result) -> Result:
        """Return the result without the disparities that `Rectifier.clean` removes, and then without speckles."""
        disparity = result.disparity
        if self.rectifier is not None:
            disparity = self.rectifier.clean(disparity, self.settings)
        return replace(result, disparity=self.speckle.apply(disparity, self.settings))


def match_source(device: Device, source: Source, matching: Matching, frames: int | None = None,
                 stopped: Callable[[], bool] = lambda: False) -> Iterator[MatchedShot]:
    """Match the pairs of a source; a remote device gets the next pair while it matches the one before.

    Parameters
    ----------
    frames
        Largest number of pairs; None for all.
    stopped
        Called before each pair: once it returns true no further pair is taken, and those on their way are finished.

    Raises
    ------
    As `Device.stream`, `Source` and `Rectifier.rectify`.
    """
    waiting = deque[Shot]()

    def pairs() -> Iterator[Pair]:
        # `stopped` is asked before the source: a stopped stream must not take another pair from a camera.
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
        yield MatchedShot(shot, result, depth, time.monotonic() - shot.taken_at_s)
