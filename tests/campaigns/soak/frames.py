#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Small random frames and settings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.base import Pair
from support.expected import expected_map
from support.pairs import textured_pair
from support.settings import SettingDraws

from .soc import MATCHER

#: Most rows, and most pixels of a row, of a usual frame; one frame in ten is larger. Small frames take less time.
MOST_ROWS, MOST_COLUMNS = 12, 44
LARGE_ROWS              = 32


@dataclass(frozen=True)
class Batch:
    """Pairs that share settings, and their expected maps."""
    settings: MatcherSettings
    pairs:    list[Pair]
    maps:     list[NDArray[np.int16]]


class BatchDraws(SettingDraws):
    """Draw batches for the soaked matcher."""

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng, block_size=MATCHER.max_block_size, disparities=MATCHER.disparities,
                         min_disparity=MATCHER.max_width - MATCHER.disparities - MATCHER.max_block_size + 1)
        self.pixels = rng

    def batch(self, count: int) -> Batch:
        """Draw pairs of sizes from the smallest that the settings allow to the largest of the soaked matcher."""
        settings = self.settings()
        least    = settings.minimum_size
        pairs    = []
        for _ in range(count):
            usual = (max(MOST_COLUMNS, least[0]), MOST_ROWS)
            most  = (MATCHER.max_width, LARGE_ROWS) if self.pixels.random() < 0.1 else usual
            width, height = (int(self.pixels.integers(*ends))
                             for ends in zip(least, (most[0] + 1, most[1] + 1), strict=True))
            pairs.append(textured_pair(width, height, self.pixels, int(self.pixels.integers(1, 20))))
        return Batch(settings, pairs, [expected_map(*pair, settings) for pair in pairs])
