#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher's emitted Verilog against cv2.StereoBM: every pixel, hundreds of settings, awkward images."""

from __future__ import annotations

import os

import pytest

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.sim.cores.cosim import CosimMatcher
from support.data import PAIRS, stereo_pair
from support.image_pairs import awkward_pairs
from support.opencv import same_as_opencv
from support.pairs import generator
from support.settings import OpenCVDraws

#: Number of drawn settings; `make sweep` draws more.
USUAL_SETTINGS = 200
SETTINGS       = int(os.environ.get("LITESTEREO_SETTINGS", USUAL_SETTINGS))
PARTS          = 4

#: Pairs several times as large as the others get a tenth of the settings.
LARGE_PAIRS = ("aloe",)

#: Most disparities drawn.
LARGEST = 64


class Matchers(dict[int, CosimMatcher]):
    """Matchers, built on first use."""

    def __missing__(self, disparities):
        self[disparities] = CosimMatcher(MatcherParameters(1300, disparities=disparities, max_block_size=21))
        return self[disparities]


@pytest.fixture(scope="module")
def matchers():
    """Return matchers wide enough for all pairs, by their number of disparities."""
    # Counting lines doubles the time, and other tests run the same lines.
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("LITESTEREO_COVERAGE", raising=False)
        yield (built := Matchers())
    for matcher in built.values():
        matcher.close()


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("name", PAIRS)
def test_data_sets(matchers, name, part):
    """Every pixel of every pair is OpenCV's, with the same settings for all pairs.

    The first settings run on a matcher with all disparities, the others on one with just those of the settings: fewer
    disparities take less time.
    """
    pair  = stereo_pair(name)
    draws = OpenCVDraws(generator(70, part))
    for _ in range(-(-SETTINGS//(PARTS*10 if name in LARGE_PAIRS else PARTS))):
        settings      = draws.settings()
        matcher       = matchers[LARGEST if part == 0 else settings.disparities]
        disparity, *_ = matcher.match_settings(pair.left, pair.right, settings)
        same_as_opencv(disparity, pair.left, pair.right, settings)


def test_awkward_images(matchers):
    """Constant, saturated and striped images, single pixels and ties give OpenCV's map: five images per setting."""
    rng    = generator(71)
    draws  = OpenCVDraws(rng)
    images = 0
    while images < 5*SETTINGS:
        settings = draws.settings()
        width    = settings.minimum_size[0] + int(rng.integers(0, 40))
        height   = settings.block_size + 1 + int(rng.integers(0, 12))
        for name, left, right in awkward_pairs(rng, width, height):
            print(name, width, height)
            disparity, *_ = matchers[LARGEST].match_settings(left, right, settings)
            same_as_opencv(disparity, left, right, settings)
            images += 1
    if SETTINGS >= USUAL_SETTINGS:
        draws.check()
