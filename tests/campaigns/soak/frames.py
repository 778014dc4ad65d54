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


def _settings(rng: np.random.Generator) -> MatcherSettings:
    return MatcherSettings(
        disparities       = 16,
        block_size        = int(rng.choice([5, 7, 9])),
        min_disparity     = int(rng.choice([0, 0, 1, 7])),
        prefilter         = str(rng.choice(["xsobel", "none"])),
        prefilter_cap     = int(rng.integers(1, 64)),
        texture_threshold = int(rng.choice([0, 10, 200])),
        uniqueness_ratio  = int(rng.integers(0, 101)),
        disp12_max_diff   = int(rng.choice([-1, 0, 1, 5])),
        subpixel          = bool(rng.integers(2)),
        median            = bool(rng.integers(2)),
    )


def drawn_batch(rng: np.random.Generator, count: int) -> Batch:
    """Draw pairs of sizes from the smallest that the settings allow to the largest of the soaked matcher."""
    settings = _settings(rng)
    least    = settings.minimum_size
    pairs    = []
    for _ in range(count):
        most          = (MATCHER.max_width, LARGE_ROWS) if rng.random() < 0.1 else (MOST_COLUMNS, MOST_ROWS)
        width, height = (int(rng.integers(*ends)) for ends in zip(least, (most[0] + 1, most[1] + 1), strict=True))
        pairs.append(textured_pair(width, height, rng, int(rng.integers(1, 20))))
    return Batch(settings, pairs, [expected_map(*pair, settings) for pair in pairs])
