#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames through a device with the real gateware; each map is compared with the reference model's."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.base import Pair
from litestereo.host_tools.devices.connect import Device, connect
from litestereo.host_tools.link.settings import LinkSettings

from .expected import expected_map
from .pairs import SEED, textured_pair


def check_stream(device: Device, pairs: Iterable[Pair], settings: MatcherSettings) -> None:
    """Match pairs, one after the other with several in flight, and compare each map with the model's."""
    for (left, right), result in zip(pairs, device.stream(pairs, settings), strict=True):
        assert np.array_equal(result.disparity, expected_map(left, right, settings))
        # The left-right check and the median keep a row each, so a map ends rows after its pixels.
        height, width = left.shape
        assert result.clocks <= 1.1*left.size + 20*height + 3*width + 2000


def check_small_frame(url: str, link_settings: LinkSettings | None = None) -> None:
    """Match one pair in a separate session."""
    left, right = textured_pair(70, 20, np.random.default_rng(SEED))
    with connect(url, link_settings) as device:
        check_stream(device, [(left, right)], MatcherSettings(32, 7))
