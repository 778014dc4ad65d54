#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The assembled matcher's emitted Verilog against the reference model, on awkward images and at every limit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from litestereo.gateware.common.parameters import FEATURES, MatcherParameters
from litestereo.gateware.matcher.matcher import Matcher, matcher_settings
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.cores.cosim import CosimMatcher, pixel_words, signals
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.sim.models.stereo_bm import stereo_bm
from support.data import FOLDERS, stereo_pair
from support.image_pairs import awkward_pairs
from support.pairs import generator, textured_pair
from support.settings import SettingDraws

MAX_WIDTH, DISPARITIES, MAX_BLOCK = 1024, 64, 21

#: Without prefilter, tests and fraction: the plain sum of absolute differences.
BARE = {"prefilter": "none", "texture_threshold": 0, "uniqueness_ratio": 0, "subpixel": False}

#: All options.
ALL = MatcherSettings(64, 9, 2, texture_threshold=200, uniqueness_ratio=10, disp12_max_diff=1, median=True)


@pytest.fixture(scope="module")
def matcher():
    """Return the matcher that `cosim:` builds by default."""
    matcher = CosimMatcher(MatcherParameters(MAX_WIDTH, disparities=DISPARITIES, max_block_size=MAX_BLOCK))
    yield matcher
    matcher.close()


def check(matcher, left, right, settings, **flow):
    """Match a pair and compare it with the model; return the clocks of the frame and of the first row."""
    disparity, clocks, first_row = matcher.match_settings(left, right, settings, **flow)
    expected = stereo_bm(left, right, settings)
    assert np.array_equal(disparity, expected), (np.argwhere(disparity != expected)[:3].tolist(), settings, flow)
    return clocks, first_row


@pytest.mark.long
def test_awkward_images(matcher):
    """Any settings, ties, saturation and stripes, with gaps on both sides, give the model's map."""
    rng   = generator(30)
    draws = SettingDraws(rng)
    for number in range(40):
        settings      = draws.settings()
        width, height = (size + int(extra) for size, extra in zip(settings.minimum_size, rng.integers(0, (40, 12)),
                                                                  strict=True))
        for name, left, right in awkward_pairs(rng, width, height):
            print(name, width, height)
            valid, ready = rng.choice([1.0, 0.7, 0.3], 2)
            check(matcher, left, right, settings, valid=valid, ready=ready, seed=number)
    draws.check()


@pytest.mark.parametrize("name", FOLDERS)
def test_block_matching_alone(matcher, name):
    """Real pairs give the plain matcher's map, for every block size with every number of disparities."""
    pair = stereo_pair(name)
    for block_size in (5, 7, 9, 15):
        for disparities in (16, 32, 64):
            check(matcher, pair.left, pair.right, MatcherSettings(disparities, block_size, **BARE))


@pytest.mark.parametrize("disparities", range(16, DISPARITIES + 1, 16))
@pytest.mark.parametrize("min_disparity", [0, 3, 255])
def test_smallest_image(matcher, disparities, min_disparity):
    """Only one pixel can have a disparity, and it is where cv2.StereoBM has it."""
    for block_size in range(5, MAX_BLOCK + 1, 2):
        for disp12_max_diff in (-1, 0):
            settings      = MatcherSettings(disparities, block_size, min_disparity, disp12_max_diff=disp12_max_diff,
                                           **BARE)
            width, height = settings.minimum_size
            left, right   = textured_pair(width, height, generator(31, disparities, block_size))
            check(matcher, left, right, settings)
        unchecked = dataclasses.replace(settings, disp12_max_diff=-1)
        valid     = np.argwhere(matcher.match_settings(left, right, unchecked)[0] != settings.invalid)
        margin    = block_size//2
        assert valid.tolist() == [[margin, min_disparity + disparities - 1 + margin]]


def test_widest_image(matcher):
    """The widest image works at the smallest and the largest block, without options and with all."""
    left, right = textured_pair(MAX_WIDTH, 30, generator(32))
    for block_size in (5, MAX_BLOCK):
        check(matcher, left, right, MatcherSettings(DISPARITIES, block_size, **BARE))
        check(matcher, left, right, dataclasses.replace(ALL, block_size=block_size))


@pytest.mark.parametrize("block, cap, column_bits, cost_bits", [(7, 36, 9, 12), (9, 50, 10, 13), (5, 31, 9, 11)])
def test_sums_of_a_smaller_cap(block, cap, column_bits, cost_bits):
    """Sums that have no bit more than the largest cap and block need hold the extremes, and are OpenCV's."""
    parameters = MatcherParameters(64, disparities=16, max_block_size=block, max_prefilter_cap=cap,
                                   features=set(FEATURES) - {"raw"})
    assert (parameters.column_bits, parameters.cost_bits) == (column_bits, cost_bits)
    matcher = CosimMatcher(parameters)
    rng     = generator(34, cap)
    # Left edges are right images' opposite ones: filtered pixels are 0 and twice the cap.
    stripes = np.tile(np.array([0, 0, 255, 255], np.uint8), (20, 16))
    pairs   = [(stripes, np.roll(stripes, 2, axis=1)), *(pair for _, *pair in awkward_pairs(rng, 64, 20))]
    for left, right in pairs:
        for least in (MatcherSettings(16, block, prefilter_cap=cap, texture_threshold=0, uniqueness_ratio=0),
                      MatcherSettings(16, block, prefilter_cap=cap, disp12_max_diff=1)):
            check(matcher, left, right, least)
    matcher.close()


def test_frames_back_to_back(matcher):
    """A second frame waits at the sink while the first one ends; the matcher also stalls for the output."""
    rng   = generator(33)
    pairs = [textured_pair(100, 25, rng), textured_pair(100, 25, rng, 11)]
    words = np.concatenate([pixel_words(*pair) for pair in pairs])
    for settings in (MatcherSettings(32, 9), MatcherSettings(32, 9, disp12_max_diff=0),
                     MatcherSettings(32, 9, median=True), dataclasses.replace(ALL, disparities=32)):
        for valid, ready in [(1.0, 1.0), (1.0, 0.3), (0.3, 1.0)]:
            matcher.core.set(**signals(100, 25, settings))
            result = matcher.core.run(words, 5000, valid=valid, ready=ready, seed=5)
            maps   = result.words.astype(np.uint16).view(np.int16).reshape(2, 25, 100)
            for disparity, pair in zip(maps, pairs, strict=True):
                assert np.array_equal(disparity, stereo_bm(*pair, settings))
            assert result.first.nonzero()[0].tolist() == [0, 2500]
            assert result.last.nonzero()[0].tolist() == [2499, 4999]


def test_reset_in_mid_frame(matcher):
    """After a reset at any clock, of all or of the matcher alone, the next frame is correct, with any settings."""
    rng   = generator(34)
    given_up, whole = (SettingDraws(rng, min_disparity=130 - DISPARITIES - MAX_BLOCK + 1) for _ in range(2))
    for number in range(40):
        left, right = textured_pair(130, 30, rng)
        matcher.core.set(**signals(130, 30, given_up.settings()))
        matcher.core.run(pixel_words(left, right), 3900, valid=0.8, ready=0.8, seed=1,
                         reset_clock=int(rng.integers(1, 6500)))
        (matcher.core.reset if number % 2 else matcher.give_up)()
        check(matcher, left, right, whole.settings())
    given_up.check()
    whole.check()


@pytest.mark.long
@pytest.mark.parametrize("disparities", [64, 128])
def test_one_pixel_per_clock(disparities):
    """640x480 with all options takes at most 1.05 clocks per pixel at block 9; rows come in time, at any setting."""
    matcher = CosimMatcher(MatcherParameters(640, disparities=disparities, max_block_size=MAX_BLOCK))
    left, right = textured_pair(640, 480, generator(35))
    for settings, most in [(dataclasses.replace(ALL, disparities=disparities), 1.05), (MatcherSettings(16, 9), 1.05),
                           (MatcherSettings(disparities, 9, **BARE), 1.05),
                           (dataclasses.replace(ALL, block_size=MAX_BLOCK), 1.07)]:
        clocks, first_row = check(matcher, left, right, settings)
        assert clocks <= most*640*480
        # A row waits for the lower half of its block, and for a row each of prefilter, left-right check and median.
        margin  = settings.block_size//2
        entered = 640*(margin + 1)
        assert first_row <= entered + 640*(margin + 4)
    matcher.core.run(pixel_words(left, right), 640*480, reset_clock=20000)
    matcher.give_up()
    check(matcher, left[:50], right[:50], ALL)
    matcher.close()


@pytest.mark.parametrize("disparities, max_block_size, features", [
    (16, 5, FEATURES), (128, 9, FEATURES), (112, 31, FEATURES), (32, 9, ["raw"]), (32, 9, ["xsobel"]),
    (48, 11, ["raw", "left_right"]), (32, 9, ["xsobel", "texture", "uniqueness"]),
    (32, 9, ["xsobel", "raw", "subpixel"]), (32, 9, ["raw", "min_disparity", "median"]),
], ids=str)
@pytest.mark.long
def test_built_sizes(disparities, max_block_size, features):
    """The smallest and the largest matcher, disparities that are no power of two, and fewer stages work."""
    rng       = generator(36, disparities)
    max_width = disparities + 2*max_block_size + 20
    core      = CosimMatcher(MatcherParameters(max_width, disparities=disparities, max_block_size=max_block_size,
                                               features=features))
    for used in sorted({16, disparities//2//16*16 or 16, disparities}):
        for block_size in sorted({5, max_block_size}):
            settings = without(dataclasses.replace(ALL, disparities=used, block_size=block_size), features)
            for width in (settings.minimum_size[0], max_width):
                left, right = textured_pair(width, block_size + 3, rng, 14)
                check(core, left, right, settings, valid=0.9, ready=0.9)
    core.close()


def without(settings, features):
    """Return settings without those that need features that were not built."""
    off = {
        "xsobel":        {"prefilter": "none"},
        "texture":       {"texture_threshold": 0},
        "uniqueness":    {"uniqueness_ratio": 0},
        "subpixel":      {"subpixel": False},
        "left_right":    {"disp12_max_diff": -1},
        "min_disparity": {"min_disparity": 0},
        "median":        {"median": False},
    }
    for feature, values in off.items():
        if feature not in features:
            settings = dataclasses.replace(settings, **values)
    return settings


@pytest.mark.parametrize("parameters, message", [
    ({"disparities": 24},            "multiple of 16"),
    ({"disparities": 0},             "multiple of 16"),
    ({"disparities": 144},           "multiple of 16"),
    ({"max_block_size": 8},          "must be odd"),
    ({"max_block_size": 3},          "must be odd"),
    ({"max_block_size": 33},         "must be odd"),
    ({"max_width": 70},              "max_width"),
    ({"max_width": 5000},            "max_width"),
    ({"max_height": 8},              "max_height"),
    ({"max_height": 4096},           "max_height"),
    ({"features": ["xsobel", "sgm"]}, "features must be some of .* not sgm"),
    ({"features": ["subpixel"]},     "xsobel, raw or both"),
    ({"features": ["raw", "texture"]}, "texture needs the feature xsobel"),
])
def test_bad_parameters(parameters, message):
    """Bad parameters are refused by name."""
    with pytest.raises(ValueError, match=message):
        MatcherParameters(**parameters)


def test_sink_waits_for_a_frame():
    """Between frames and in reset the sink is not ready, and the source offers nothing."""
    module = Matcher(MatcherParameters(64, 100, 16, 5))
    core   = StreamCore(module, [name for name, *_ in matcher_settings(module.parameters)])
    core.set(**signals(20, 5, MatcherSettings(16, 5)))
    assert len(core.run(np.zeros(0, np.uint32), 1, idle_clocks=200).words) == 0
    core.close()
