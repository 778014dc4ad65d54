#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The reference model against `cv2.StereoBM` on real pairs, random settings and awkward images."""

import itertools

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.models import block_matching as model
from litestereo.sim.models import stages
from litestereo.sim.models.stereo_bm import minimum_size, stereo_bm, used_columns
from support.data import stereo_pair
from support.image_pairs import awkward_pairs
from support.limits import Draws, setting_ranges
from support.opencv import opencv_map, same_as_opencv
from support.pairs import generator, textured_pair
from support.settings import OpenCVDraws, UncheckedSettings


@pytest.mark.parametrize("name", ["tsukuba", "venus", "teddy", "cones"])
def test_middlebury(name):
    """The defaults, every test switched on and off, and random settings give OpenCV's map."""
    pair  = stereo_pair(name)
    rng   = generator(60, *name.encode())
    draws = OpenCVDraws(rng)
    cases  = [MatcherSettings(block_size=9), MatcherSettings(block_size=21)]
    cases += [MatcherSettings(block_size=9, disp12_max_diff=1)]
    cases += [MatcherSettings(48, 11, texture_threshold=0, uniqueness_ratio=0, disp12_max_diff=difference)
              for difference in (-1, 0, 2)]
    cases += [draws.settings() for _ in range(12)]
    for settings in cases:
        same_as_opencv(stereo_bm(pair.left, pair.right, settings), pair.left, pair.right, settings)


def test_awkward_images():
    """A thousand small images give OpenCV's map: ties, saturation, stripes, single pixels, odd and even heights."""
    rng    = generator(61)
    draws  = OpenCVDraws(rng, block_size=15, disparities=32)
    images = 0
    while images < 1000:
        settings = draws.settings()
        width    = settings.minimum_size[0] + int(rng.integers(0, 40))
        height   = settings.block_size + 1 + int(rng.integers(0, 12))
        for name, left, right in awkward_pairs(rng, width, height):
            print(name, width, height)
            same_as_opencv(stereo_bm(left, right, settings), left, right, settings)
            images += 1
    draws.check()


def test_negative_disparities():
    """Ranges wholly and partly below zero give OpenCV's map."""
    rng = generator(62)
    for min_disparity in (-1, -7, -15, -16, -31, -32, -50):
        draws = OpenCVDraws(rng, min_disparity, disparities=32)
        for _ in range(6):
            settings    = draws.settings()
            width       = 130 + int(rng.integers(0, 30))
            left, right = textured_pair(width, 40, rng, int(rng.integers(1, 9)))
            same_as_opencv(stereo_bm(right, left, settings), right, left, settings)


@pytest.mark.parametrize("disp12_max_diff", [-1, 0])
@pytest.mark.parametrize("min_disparity", [-20, -15, 0, 3])
def test_narrow_images(disp12_max_diff, min_disparity):
    """Widths from that of a block give OpenCV's map: below the smallest size all invalid, and there a single column."""
    settings = UncheckedSettings(16, 7, min_disparity, texture_threshold=0, uniqueness_ratio=0,
                                 disp12_max_diff=disp12_max_diff)
    rng      = generator(63)
    smallest = minimum_size(settings)[0]
    for width in range(8, smallest + 20):
        left, right = textured_pair(width, 10, rng, 5)
        disparity   = stereo_bm(left, right, settings)
        same_as_opencv(disparity, left, right, settings)
        assert (disparity == settings.invalid).all() or width >= smallest
    one  = stereo_bm(*textured_pair(20 + smallest, 7, rng, 5), settings)
    assert np.unique(np.nonzero(one != settings.invalid)[0]).tolist() == [3]


def test_small_images_are_refused_as_opencv_does():
    """Both refuse images smaller than a block; a height equal to the block's is an error only in OpenCV."""
    settings = MatcherSettings(16, 9)
    for shape in ((8, 60), (60, 8), (1, 1)):
        image = np.zeros(shape, np.uint8)
        with pytest.raises(ValueError, match="block of 9"):
            stereo_bm(image, image, settings)
        with pytest.raises(cv2.error):
            opencv_map(image, image, settings)


@pytest.mark.parametrize("wrong", [
    {"disparities": 0}, {"disparities": 24}, {"block_size": 3}, {"block_size": 8}, {"block_size": 257},
    {"prefilter_cap": 0}, {"prefilter_cap": 64}, {"texture_threshold": -1}, {"uniqueness_ratio": -1},
])
def test_settings_that_opencv_refuses(wrong):
    image   = np.zeros((300, 400), np.uint8)
    with pytest.raises(ValueError, match=next(iter(wrong))):
        stereo_bm(image, image, UncheckedSettings(**wrong))
    matcher = cv2.StereoBM_create()
    setters = {"disparities": "NumDisparities", "prefilter_cap": "PreFilterCap"}
    for name, value in wrong.items():
        getattr(matcher, f"set{setters.get(name, name.title().replace('_', ''))}")(value)
    with pytest.raises(cv2.error):
        matcher.compute(image, image)


def test_improper_images_and_prefilter():
    image = np.zeros((30, 60), np.uint8)
    for left, right in ((image, image[1:]), (image.astype(np.int16), image), (image[None], image[None])):
        with pytest.raises(ValueError, match="image"):
            stereo_bm(left, right, MatcherSettings(16, 9))
    with pytest.raises(ValueError, match="prefilter"):
        stereo_bm(image, image, UncheckedSettings(prefilter="sobel"))


def test_without_any_extra_it_is_the_plain_model():
    """Without prefilter, tests and fractions the map is that of the sum of absolute differences."""
    rng   = generator(64)
    draws = Draws(rng, setting_ranges(disparities=48, block_size=15))
    for _ in range(20):
        settings    = MatcherSettings(draws("disparities"), draws("block_size"), prefilter="none", uniqueness_ratio=0,
                                     subpixel=False)
        width       = settings.minimum_size[0] + int(rng.integers(0, 40))
        left, right = textured_pair(width, settings.block_size + int(rng.integers(0, 9)), rng)
        plain       = model.match(left, right, settings.disparities, settings.block_size)
        assert np.array_equal(stereo_bm(left, right, settings), plain)
        assert model.minimum_size(settings.disparities, settings.block_size) == minimum_size(settings)


def test_raw_pixels_do_what_a_prefilter_in_their_place_would():
    """Grey values that look prefiltered give OpenCV's costs, as if its prefilter were off."""
    rng         = generator(65)
    settings    = MatcherSettings(16, 5, prefilter="none", uniqueness_ratio=20)
    left, right = textured_pair(40, 12, rng, 4)
    disparity   = stereo_bm(left, right, settings)
    for y, x in itertools.product(range(12), range(40)):
        found = settings.invalid
        if 2 <= y < 10 and 17 <= x < 38:
            block = left[y - 2:y + 3, x - 2:x + 3].astype(int)
            costs = [int(np.abs(block - right[y - 2:y + 3, x - d - 2:x - d + 3]).sum()) for d in range(16)]
            best  = max(d for d in range(16) if costs[d] == min(costs))
            limit = costs[best] + costs[best]*20//100
            if all(costs[d] > limit for d in range(16) if abs(d - best) > 1):
                offset = 0
                if 0 < best < 15:
                    below, above = costs[best - 1], costs[best + 1]
                    scale        = below + above - 2*costs[best] + abs(below - above)
                    offset       = int((below - above)*256/scale) if scale else 0
                found = (256*best + offset + 15) >> 4
        assert disparity[y, x] == found, (y, x)


@pytest.mark.parametrize("settings", [
    MatcherSettings(32, 9, prefilter_cap=63), MatcherSettings(16, 25), MatcherSettings(32, 15, 5),
    MatcherSettings(32, 9, prefilter="none"), MatcherSettings(16, 9, subpixel=False),
])
@pytest.mark.parametrize("difference", [0, 1, 3])
def test_left_right_check_of_large_costs(settings, difference):
    """Where OpenCV's matcher corrupts the costs, the reference is its function on correct costs."""
    left, right = stereo_pair("cones").left[:120, :260], stereo_pair("cones").right[:120, :260]
    if settings.prefilter == "xsobel":
        left, right = (stages.prefilter_xsobel(image, settings.prefilter_cap) for image in (left, right))
    columns     = used_columns(left.shape[1], settings)
    costs       = stages.block_costs(left, right, columns)
    index, cost = stages.winners(costs)
    disparity   = stages.subpixel(costs, index, settings.min_disparity)
    disparity[~stages.uniqueness_mask(costs, index, 10)] = settings.invalid
    keep        = stages.left_right_check(disparity, cost, difference, columns)
    whole_map   = np.full((len(cost), left.shape[1]), settings.invalid, np.int16)
    whole_cost  = np.zeros(whole_map.shape, np.int32)
    used        = slice(columns.first, columns.first + columns.count)
    whole_map[:, used], whole_cost[:, used] = disparity, cost
    checked  = cv2.validateDisparity(whole_map, whole_cost, settings.min_disparity, settings.disparities,
                                     difference)
    expected = np.where(keep, disparity, settings.invalid)
    assert np.array_equal(checked[:, used], expected)
    assert (expected != disparity).any() or difference > 0


def test_bands_of_rows_leave_no_seam(monkeypatch):
    left, right = textured_pair(100, 41, generator(66))
    settings    = MatcherSettings(32, 9, disp12_max_diff=1)
    whole       = stereo_bm(left, right, settings)
    for costs in (1, 10000, 20000):
        monkeypatch.setattr("litestereo.sim.models.stereo_bm._MAX_COSTS", costs)
        assert np.array_equal(stereo_bm(left, right, settings), whole)


def test_median():
    """The median is the middle of nine values, with repeated edges; invalid pixels count too."""
    rng         = generator(67)
    left, right = textured_pair(60, 25, rng)
    disparity   = stereo_bm(left, right, MatcherSettings(16, 5))
    filtered    = stereo_bm(left, right, MatcherSettings(16, 5, median=True))
    padded      = np.pad(disparity, 1, mode="edge")
    around      = [padded[y:y + 25, x:x + 60] for y in range(3) for x in range(3)]
    assert np.array_equal(filtered, np.sort(around, axis=0)[4])
    assert (filtered != disparity).any()
    assert filtered.dtype == np.int16
