#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The temporal filter: steady surfaces, and holes with what was there before."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .disparity_map import DisparityMap
from .map_filter import MapFilter, parameter
from .settings import MatcherSettings

#: Frames that a pixel remembers.
HISTORY_FRAMES = 8

#: By the number of `holes_fill`: how many of the last so many frames must have had a disparity for a hole to be filled.
#: None: none is filled.
PERSISTENCE: tuple[tuple[int, int] | None, ...] = (None, (8, 8), (2, 3), (2, 4), (2, 8), (1, 2), (1, 5), (1, 8), (0, 0))


@dataclass
class _Memory:
    """What is kept of earlier maps: 5 bytes per pixel of a map, and of maps of one size and range only.

    `last` is the filtered disparity, float32, H x W, in sixteenths, nan if there never was one. `history` has a bit for
    each of the last eight frames, uint8, H x W, the newest in bit 0: whether it agreed with `last`.
    """

    settings: MatcherSettings
    factor:   int
    last:     NDArray[np.float32]
    history:  NDArray[np.uint8]


@dataclass
class _Kept:
    """The memory of a filter; None before the first map."""

    memory: _Memory | None = None


@dataclass(frozen=True)
class TemporalFilter(MapFilter):
    """Average each pixel over time, and fill holes with earlier disparities, as librealsense's temporal filter.

    Where a pixel has a disparity that differs from the last result by less than `filter_smooth_delta` sixteenths of a
    pixel, the result is alpha times it plus 1 - alpha times the last result. Where it differs by that or more it is the
    result, and the history of the pixel begins anew. Last results are real numbers (float32), so a slow change is not
    lost by rounding; what `process` returns is rounded to sixteenths.

    A pixel without a disparity gets the last result of that pixel, however old it is, if the history says so:
    `holes_fill` is librealsense's persistency index. 0 fills none; 1 if all of the last 8 frames had a disparity there;
    2 to 4 if two of the last 3, 4 or 8 had one; 5 to 7 if one of the last 2, 5 or 8 had one; 8 always. A filled pixel
    does not count as one with a disparity in the frames that follow.

    The first map remains as it is. A map of another size or range begins anew, and so does one after `reset`. Memory is
    5 bytes per pixel. In a scene that moves the filter smears; it is for still ones.
    """

    name = "temporal"
    text = "mean over time; holes get what was there before"
    needs_frames = True

    filter_smooth_alpha: float = parameter(0.4, 0, 1, "share of a new map in its result, 1 for no smoothing")
    filter_smooth_delta: int   = parameter(20, 1, 100, "least step that is another surface, sixteenths of a pixel")
    holes_fill:          int   = parameter(3, 0, 8, "when a hole is filled: 0 never, 1 if 8 of the last 8 frames had a "
                                                    "disparity, 2 if 2 of 3, 3 if 2 of 4, 4 if 2 of 8, 5 if 1 of 2, "
                                                    "6 if 1 of 5, 7 if 1 of 8, 8 always")
    _kept: _Kept = dataclasses.field(default_factory=_Kept, init=False, repr=False, compare=False)

    def reset(self) -> None:
        """Forget all earlier maps."""
        self._kept.memory = None

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the steady map, and remember it; `map_` remains as it is."""
        memory = self._memory(map_)
        valid  = map_.valid
        now    = map_.disparity.astype(np.float32)
        seen   = ~np.isnan(memory.last)
        with np.errstate(invalid="ignore"): # nan: there is no earlier disparity.
            agrees = valid & (np.abs(now - memory.last) < np.float32(self.filter_smooth_delta))
        alpha  = np.float32(self.filter_smooth_alpha)
        filled = ~valid & seen & self._persists(memory.history)
        result = np.where(agrees, alpha*now + (np.float32(1) - alpha)*memory.last, now)
        memory.last    = np.where(valid, result, memory.last)
        memory.history = np.where(valid & ~agrees, np.uint8(1), memory.history << 1 | agrees).astype(np.uint8)
        return map_.with_values(np.where(seen | valid, memory.last, 0), valid | filled)

    def _memory(self, map_: DisparityMap) -> _Memory:
        """Return what is kept of maps like this one: nothing if the last one had another size or range."""
        memory = self._kept.memory
        if (memory is None or memory.last.shape != map_.disparity.shape or memory.factor != map_.factor
                or memory.settings != map_.settings):
            shape  = map_.disparity.shape
            memory = _Memory(map_.settings, map_.factor, np.full(shape, np.nan, np.float32), np.zeros(shape, np.uint8))
            self._kept.memory = memory
        return memory

    def _persists(self, history: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return where the last frames had enough disparities."""
        rule = PERSISTENCE[int(self.holes_fill)]
        if rule is None:
            return np.zeros(history.shape, bool)
        needed, frames = rule
        table = np.array([(number & (1 << frames) - 1).bit_count() >= needed for number in range(1 << HISTORY_FRAMES)])
        return np.asarray(table[history])
