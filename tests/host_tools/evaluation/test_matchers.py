#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""OpenCV's matchers take the settings of a device: each one changes the map, and StereoBM's is the model's."""

import dataclasses

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError, UnsupportedError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.evaluation.matchers import OpenCVMatcher, is_shared, open_matcher, opencv_name
from support.pairs import generator

SETTINGS = MatcherSettings(disparities=16, block_size=9)

#: A value of each setting that changes the map of `pair`.
OTHERS = {"disparities": 32, "block_size": 7, "min_disparity": 3, "prefilter_cap": 5, "texture_threshold": 900,
          "uniqueness_ratio": 40, "disp12_max_diff": 1}


@pytest.fixture(scope="module")
def pair():
    """A scene whose left half is 4 and whose right half 12 pixels apart, with noise, and with a flat part."""
    rng   = generator(75)
    scene = cv2.GaussianBlur(rng.integers(0, 256, (60, 200), np.uint8), (0, 0), 1.5)
    scene[20:40] = scene[20:40]//12 + 100
    left, right  = scene[:, 20:180].copy(), scene[:, 24:184].copy()
    right[:, 60:] = scene[:, 92:192]
    noise = rng.integers(-6, 7, (2, *left.shape))
    return [np.clip(image + more, 0, 255).astype(np.uint8) for image, more in zip((left, right), noise, strict=True)]


def matched(name, pair_, settings):
    matcher = open_matcher(name)
    map_    = matcher.match(*pair_, settings)
    matcher.close()
    return map_


@pytest.mark.parametrize("name", OTHERS)
def test_each_setting_of_stereo_bm(pair, name):
    settings = dataclasses.replace(SETTINGS, **{name: OTHERS[name]})
    map_     = matched(opencv_name("bm"), pair, settings)
    assert np.array_equal(map_, matched("model:", pair, settings))
    assert not np.array_equal(map_, matched(opencv_name("bm"), pair, SETTINGS))


@pytest.mark.parametrize("name", sorted(OTHERS.keys() - {"texture_threshold", "disp12_max_diff"}))
def test_each_setting_of_stereo_sgbm(pair, name):
    settings = dataclasses.replace(SETTINGS, **{name: OTHERS[name]})
    map_     = matched(opencv_name("sgbm"), pair, settings)
    assert not np.array_equal(map_, matched(opencv_name("sgbm"), pair, SETTINGS))
    assert map_.min() == settings.invalid


def test_stereo_sgbm_without_a_left_right_check(pair):
    """OpenCV's own -1 is a check: a difference that cannot be is none."""
    valid = {difference: int((matched("cv2:sgbm", pair, dataclasses.replace(SETTINGS, disp12_max_diff=difference))
                              >= 0).sum()) for difference in (-1, 0, 1, 8, 254)}
    assert valid[0] == valid[1] < valid[8] <= valid[254] == valid[-1]


def test_what_opencv_leaves_of_the_memory_is_no_disparity(pair, monkeypatch):
    """With a smallest disparity StereoBM does not write all of the border."""
    settings = dataclasses.replace(SETTINGS, min_disparity=3)
    expected = matched("model:", pair, settings)

    class Littering:
        def __init__(self, matcher):
            self._matcher = matcher

        def compute(self, left, right):
            map_ = self._matcher.compute(left, right)
            map_[:4], map_[-4:], map_[:, :22], map_[:, -4:] = 99, 99, 99, 99
            return map_

    from litestereo.host_tools.evaluation import matchers

    made = matchers._stereo_bm
    monkeypatch.setattr(matchers, "_stereo_bm", lambda settings: Littering(made(settings)))
    assert np.array_equal(matched("cv2:bm", pair, settings), expected)


def test_what_opencv_has_not(pair):
    for change, text in (({"prefilter": "none"}, "without prefilter"), ({"subpixel": False}, "whole pixels"),
                         ({"median": True}, "a median")):
        for kind in ("bm", "sgbm"):
            with pytest.raises(UnsupportedError, match=text):
                OpenCVMatcher(kind).match(*pair, dataclasses.replace(SETTINGS, **change))
    with pytest.raises(ImageError, match="too small"):
        OpenCVMatcher("sgbm").match(*pair, dataclasses.replace(SETTINGS, disparities=256))


def test_what_several_processes_may_open():
    assert all(map(is_shared, ("cv2:bm", "cv2:sgbm", "model:", "cosim:?disparities=32")))
    assert not any(map(is_shared, ("udp://host", "tcp://host:1", "serial:/dev/ttyUSB0", "sim:",
                                   "cosim:?disparities=32&trace=wave.fst")))
