#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map that a device has to give."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.models.stereo_bm import StereoSettings, stereo_bm


def expected_map(left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
    """The reference model's map of a pair."""
    return stereo_bm(left, right, StereoSettings(**dataclasses.asdict(settings)))
