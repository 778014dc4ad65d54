#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matches the pairs of a source one after the other: maps, depth, and the latency of each."""

from __future__ import annotations

import functools
import itertools
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import Rectifier
from ..core.disparity_map import DisparityMap
from ..core.filters import FilterChain
from ..core.images import valid_percent
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from ..data.sources import Shot, Source
from ..devices.base import Device, Pair, Result
from .rectifying import Rectifying


@dataclass(frozen=True, eq=False)
class MatchedShot:
    """A shot and its map.

    Parameters
    ----------
    taken
        The images as they were taken.
    result
        The map as the device returned it, after rectification's mask and the speckle filter, and how it was matched.
    map
        The same after all filters, with its cameras if there is a calibration. It may be smaller than the images.
    depth_m
        Depth of `map`: float32, H x W, in metres, nan where there is none; None without a calibration.
    latency_s
        Time from taking the pair until its map was here, in seconds.
    rectifier
        Rectifies `taken`; None without a calibration.
    rectified
        The images that this host has rectified; None if it has not yet.
    """

    taken:     Shot
    result:    Result
    map:       DisparityMap
    depth_m:   NDArray[np.float32] | None
    latency_s: float
    rectifier: Rectifier | None = None
    rectified: Shot | None      = None

    @functools.cached_property
    def shot(self) -> Shot:
        """The images that were matched: rectified if there is a calibration, here if the device has done it."""
        if self.rectifier is None or self.rectified is not None:
            return self.rectified or self.taken
        return rectified_shot(self.taken, self.rectifier)

    @property
    def valid_of_all(self) -> float:
        """Pixels that have a disparity, in percent of all pixels of the map."""
        return valid_percent(self.map.disparity, self.map.settings.invalid)


def rectified_shot(shot: Shot, rectifier: Rectifier) -> Shot:
    """Return a shot with rectified images; raise as `Rectifier.rectify`."""
    left, right = rectifier.rectify(*shot.pair)
    return replace(shot, left=left, right=right)


@dataclass(frozen=True)
class Matching:
    """What is done to each pair of a stream: rectification if there is a calibration, the match, the filters."""

    settings:   MatcherSettings
    speckle:    SpeckleFilter
    rectifying: Rectifying | None
    filters:    FilterChain = field(default_factory=FilterChain)

    @property
    def rectifier(self) -> Rectifier | None:
        """What rectifies; None without a calibration."""
        return None if self.rectifying is None else self.rectifying.rectifier

    def finish(self, result: Result) -> Result:
        """Return the result without the disparities that `Rectifier.clean` removes, and then without speckles."""
        disparity = result.disparity
        if self.rectifier is not None:
            disparity = self.rectifier.clean(disparity, self.settings)
        return replace(result, disparity=self.speckle.apply(disparity, self.settings))

    def filtered(self, result: Result) -> DisparityMap:
        """Return the map of a finished result after all filters; raise as `FilterChain.process`."""
        geometry = None if self.rectifier is None else self.rectifier.geometry
        return self.filters.process(DisparityMap(result.disparity, self.settings, geometry))


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
    As `Device.stream`, `Source`, `Rectifier.rectify` and `FilterChain.process`.
    """
    waiting   = deque[tuple[Shot, Shot | None]]()
    rectifier = matching.rectifier
    grids     = None if matching.rectifying is None else matching.rectifying.device_grids

    def pairs() -> Iterator[Pair]:
        # `stopped` is asked before the source: a stopped stream must not take another pair from a camera.
        shots = itertools.takewhile(lambda _: not stopped(), itertools.count())
        for _, shot in zip(shots if frames is None else itertools.islice(shots, frames), source, strict=False):
            rectified = None
            if rectifier is not None and grids is None:
                rectified = rectified_shot(shot, rectifier)
            elif rectifier is not None:
                rectifier.check_size(*shot.pair)
            waiting.append((shot, rectified))
            yield (rectified or shot).pair

    matching.filters.reset()
    for matched in device.stream(pairs(), matching.settings, grids=grids):
        result          = matching.finish(matched)
        shot, rectified = waiting.popleft()
        map_            = matching.filtered(result)
        depth_m         = map_.depth_m()
        yield MatchedShot(shot, result, map_, depth_m, time.monotonic() - shot.taken_at_s, rectifier, rectified)
