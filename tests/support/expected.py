#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map that a device must return."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.base import Pair, Result
from litestereo.sim.models.stereo_bm import stereo_bm

#: Settings of the link tests, unless they say otherwise.
SETTINGS = MatcherSettings(32, 7)


def expected_map(left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
    """Return the reference model's map of a pair."""
    return stereo_bm(left, right, settings)


def expect(result: Result, pair: Pair, settings: MatcherSettings = SETTINGS,
           expected: Callable[..., NDArray[np.int16]] = expected_map) -> None:
    """Assert that a result holds the map of a pair, as the model or else `expected` computes it."""
    assert np.array_equal(result.disparity, expected(*pair, settings))
