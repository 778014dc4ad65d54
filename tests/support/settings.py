#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Random settings."""

from __future__ import annotations

import numpy as np

from litestereo.host_tools.core.settings import MatcherSettings


class UncheckedSettings(MatcherSettings):
    """Settings outside the range of any device: the model's range is OpenCV's, with disparities below zero."""

    def __post_init__(self) -> None:
        """Check nothing."""


def drawn_settings(rng: np.random.Generator, largest_block: int = 21, largest_range: int = 64,
                   min_disparity: int | None = None) -> MatcherSettings:
    """Draw settings from the whole range that OpenCV computes without an error."""
    wide = rng.random() < 0.3
    make = MatcherSettings if min_disparity is None or min_disparity >= 0 else UncheckedSettings
    return make(
        disparities       = int(rng.integers(1, largest_range // 16 + 1))*16,
        block_size        = int(rng.integers(2, largest_block // 2 + 1))*2 + 1,
        min_disparity     = int(rng.choice([0, 0, 0, 1, 5, 40]) if min_disparity is None else min_disparity),
        prefilter_cap     = int(rng.integers(32, 64) if wide else rng.integers(1, 32)),
        texture_threshold = int(rng.choice([0, 10, 200, 1500])),
        uniqueness_ratio  = int(rng.choice([0, 1, 5, 15, 40, 100])),
        disp12_max_diff   = -1 if wide else int(rng.choice([-1, 0, 1, 2, 10])),
    )


def any_settings(rng: np.random.Generator, largest_block: int = 21, largest_range: int = 64) -> MatcherSettings:
    """Draw settings from the whole range of the gateware, which is wider than that of OpenCV."""
    return MatcherSettings(
        disparities       = int(rng.integers(1, largest_range // 16 + 1))*16,
        block_size        = int(rng.integers(2, largest_block // 2 + 1))*2 + 1,
        min_disparity     = int(rng.choice([0, 0, 1, 7, 30])),
        prefilter         = str(rng.choice(["xsobel", "none"])),
        prefilter_cap     = int(rng.integers(1, 64)),
        texture_threshold = int(rng.choice([0, 10, 200, 1500])),
        uniqueness_ratio  = int(rng.integers(0, 101)),
        disp12_max_diff   = int(rng.choice([-1, 0, 1, 5, 254])),
        subpixel          = bool(rng.integers(2)),
        median            = bool(rng.integers(2)),
    )
