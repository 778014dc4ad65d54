#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher's emitted Verilog against cv2.StereoBM itself: every pixel, hundreds of settings, awkward images."""

from __future__ import annotations

import os

import pytest

from litestereo.sim.cosim import CosimMatcher
from support.awkward import awkward_pairs
from support.data import PAIRS, stereo_pair
from support.drawn import drawn_settings
from support.opencv import same_as_opencv
from support.pairs import generator

#: Settings drawn; `make sweep` draws more.
SETTINGS = int(os.environ.get("LITESTEREO_SETTINGS", "200"))
PARTS    = 4


@pytest.fixture(scope="module")
def matcher():
    """Wide enough for all pairs."""
    # Counting the lines takes as long again, and other tests run the same ones.
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("LITESTEREO_COVERAGE", raising=False)
        matcher = CosimMatcher(1300, 64, 21)
    yield matcher
    matcher.close()


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("name", PAIRS)
def test_data_sets(matcher, name, part):
    """Every pixel of a pair, with the same settings for all pairs."""
    pair = stereo_pair(name)
    rng  = generator(70, part)
    for _ in range(-(-SETTINGS//PARTS)):
        settings      = drawn_settings(rng)
        disparity, *_ = matcher.match_settings(pair.left, pair.right, settings)
        same_as_opencv(disparity, pair.left, pair.right, settings)


def test_awkward_images(matcher):
    """Constant, saturated, stripes, single pixels, ties everywhere: five small images a setting."""
    rng    = generator(71)
    images = 0
    while images < 5*SETTINGS:
        settings = drawn_settings(rng)
        width    = settings.minimum_size[0] + int(rng.integers(0, 40))
        height   = settings.block_size + 1 + int(rng.integers(0, 12))
        for name, left, right in awkward_pairs(rng, width, height):
            print(name, width, height)
            disparity, *_ = matcher.match_settings(left, right, settings)
            same_as_opencv(disparity, left, right, settings)
            images += 1
