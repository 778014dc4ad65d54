#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher with the rectification before it, in Verilator, against OpenCV: cv2.remap, then cv2.StereoBM."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.common.parameters import OPENCV_FEATURES, MatcherParameters
from litestereo.host_tools.core.errors import UnsupportedError
from litestereo.host_tools.core.features import Feature
from litestereo.host_tools.core.grid import Grid
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.cores.cosim import CosimMatcher, pixel_words
from litestereo.sim.cores.rectified_matcher import check_grids
from support.limits import BLOCK, Draws, Range
from support.opencv import same_as_opencv
from support.pairs import generator, textured_pair
from support.rectification_maps import as_grid, drawn_grids, lens, maps_of, opencv_remap, places, shifted

WIDTH, HEIGHT = 160, 120
SETTINGS      = MatcherSettings(32, 9)


def built(rows):
    return MatcherParameters(WIDTH, disparities=32, max_block_size=9, features=(*OPENCV_FEATURES, "rectification"),
                             rectification_rows=rows, rectification_height=HEIGHT)


@pytest.fixture(scope="module")
def matcher():
    """Return a build of 96 rows."""
    matcher = CosimMatcher(built(96))
    yield matcher
    matcher.close()


def test_opencv(matcher):
    """The map is OpenCV's of the pair that cv2.remap rectifies; a build of 64 rows refuses the last of the grids."""
    rng = generator(330)
    for apart in (0, 0, 70):
        level = lens(WIDTH, HEIGHT, rng), lens(WIDTH, HEIGHT, rng)
        grids = (level[0], level[1] + shifted(WIDTH, HEIGHT, 0, apart))
        left, right = textured_pair(WIDTH, HEIGHT, rng, 12)
        rectified   = [opencv_remap(*one) for one in zip((left, right), maps_of(grids, WIDTH, HEIGHT), strict=True)]
        found, *_   = matcher.match_settings(left, right, SETTINGS, grids=grids)
        same_as_opencv(found, rectified[0], rectified[1], SETTINGS)
        found, *_   = matcher.match_settings(left, right, SETTINGS)
        same_as_opencv(found, left, right, SETTINGS)
    with pytest.raises(ValueError, match="the map needs [78]. rows of the images at once, this build keeps 64"):
        check_grids(built(64), grids, WIDTH, HEIGHT)


def test_refused(matcher):
    """Grids of another size, maps that fold over, and a build without rectification are refused."""
    level = shifted(WIDTH, HEIGHT, 0, 0)
    black = np.zeros((HEIGHT, WIDTH), np.uint8)
    with pytest.raises(ValueError, match="grids are not those of frames of 160x120 pixels"):
        matcher.match_settings(black, black, SETTINGS, grids=(level, level[:-1]))
    folded = level.copy()
    folded[3, 3, 0] = -16*128
    with pytest.raises(ValueError, match="the map folds over"):
        matcher.match_settings(black, black, SETTINGS, grids=(folded, level))
    with pytest.raises(ValueError, match="no rectification"):
        check_grids(MatcherParameters(), (level, level), WIDTH, HEIGHT)
    higher = shifted(WIDTH, HEIGHT + 1, 0, 0)
    with pytest.raises(ValueError, match="up to 120 rows, not 121"):
        check_grids(built(96), (higher, higher), WIDTH, HEIGHT + 1)


def test_images(matcher):
    """The pair as the matcher gets it is that of cv2.remap, and maps and pairs may alternate."""
    rng   = generator(331)
    grids = lens(WIDTH, HEIGHT, rng), lens(WIDTH, HEIGHT, rng)
    maps  = maps_of(grids, WIDTH, HEIGHT)
    for _ in range(2):
        pair      = textured_pair(WIDTH, HEIGHT, rng, 12)
        rectified = [opencv_remap(*one) for one in zip(pair, maps, strict=True)]
        assert all(np.array_equal(*both) for both in zip(matcher.rectify(*pair, grids), rectified, strict=True))
        found, *_ = matcher.match_settings(*pair, SETTINGS, grids=grids)
        same_as_opencv(found, rectified[0], rectified[1], SETTINGS)


def check_frame(matcher, grids, width, height, rng, **flow):
    """Match a pair, and compare the map with OpenCV's."""
    pair      = textured_pair(width, height, rng, 12)
    found, *_ = matcher.match_settings(*pair, SETTINGS, grids=grids, **flow)
    same_as_opencv(found, *(opencv_remap(*one) for one in zip(pair, maps_of(grids, width, height), strict=True)),
                   SETTINGS)


def usable_grids(width, height, rng):
    """Draw grids of any kind that the build can use."""
    while True:
        grids = drawn_grids(width, height, rng)
        try:
            check_grids(built(96), grids, width, height)
        except ValueError:
            continue
        return grids


def test_drawn_maps(matcher):
    """Drawn maps of any size, with gaps and back-pressure, and broken off at any clock: the next frame is right."""
    rng   = generator(333)
    draws = Draws(rng, {"width": Range(40, WIDTH), "height": Range(10, HEIGHT), "valid": Range(2, 10),
                        "ready": Range(2, 10)})
    for _ in range(BLOCK):
        width, height = draws("width"), draws("height")
        flow  = {name: draws(name)/10 for name in ("valid", "ready")}
        grids = usable_grids(width, height, rng)
        check_frame(matcher, grids, width, height, rng, **flow)
        matcher.core.run(pixel_words(*textured_pair(width, height, rng)), int(rng.integers(1, width*height)), **flow)
        matcher.give_up()
        check_frame(matcher, grids, width, height, rng)
    draws.check()


def test_extreme_maps(matcher):
    """All fractions, and pairs of which much is outside of the images, are OpenCV's too."""
    rng   = generator(334)
    x, y  = places(WIDTH, HEIGHT)
    level = shifted(WIDTH, HEIGHT, 0, 0)
    # Both displacements grow by a 32nd of a pixel per pixel.
    grown = as_grid((x - x[0, 0])/32, (y - y[0, 0])/32)
    ends  = [shifted(WIDTH, HEIGHT, *moved) for moved in [(-255.9, 0), (31/32, 60), (1/64, -60)]]
    for grids in [(grown, grown), *((end, level) for end in ends), (level, ends[1]),
                  (shifted(WIDTH, HEIGHT, 90, -256),)*2]:
        check_frame(matcher, grids, WIDTH, HEIGHT, rng, valid=0.7)


def test_device():
    """The device `cosim:` rectifies with the cores, and refuses grids for which it keeps too few rows."""
    rng   = generator(332)
    level = lens(WIDTH, HEIGHT, rng), lens(WIDTH, HEIGHT, rng)
    grids = Grid(WIDTH, HEIGHT, level[0]), Grid(WIDTH, HEIGHT, level[1])
    apart = Grid(WIDTH, HEIGHT, level[0]), Grid(WIDTH, HEIGHT, level[1] + shifted(WIDTH, HEIGHT, 0, 100))
    pair  = textured_pair(WIDTH, HEIGHT, rng, 12)
    with connect(f"cosim:?max_width={WIDTH}&disparities=32&max_block_size=9") as device:
        assert device.info().features & Feature.RECTIFICATION
        assert device.rectification_gap(grids) == ""
        with pytest.raises(UnsupportedError, match="needs 1.. rows of the images at once, this build keeps 96"):
            device.compute(*pair, SETTINGS, grids=apart)
        left, right = (opencv_remap(*one) for one in zip(pair, maps_of(level, WIDTH, HEIGHT), strict=True))
        result      = device.compute(*pair, SETTINGS, grids=grids, images=("left", "right"))
        assert np.array_equal(result.left, left) and np.array_equal(result.right, right)
        same_as_opencv(result.disparity, left, right, SETTINGS)
        raw = device.compute(*pair, SETTINGS, images=("right",))
        assert raw.left is None and np.array_equal(raw.right, pair[1])
        same_as_opencv(raw.disparity, *pair, SETTINGS)
        # From the first raw pixel on: the rows that the map is ahead count too.
        assert result.clocks > raw.clocks


def test_a_waveform_is_of_the_matcher_alone(tmp_path):
    """With `trace` nothing rectifies."""
    level = Grid(WIDTH, HEIGHT, shifted(WIDTH, HEIGHT, 0, 0))
    with connect(f"cosim:?max_width={WIDTH}&disparities=32&max_block_size=9&trace={tmp_path}/wave.fst") as device:
        assert not device.info().features & Feature.RECTIFICATION
        assert device.rectification_gap((level, level)) == "the device does not rectify"
