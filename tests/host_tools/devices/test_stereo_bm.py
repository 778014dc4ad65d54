#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The object with cv2.StereoBM's methods, against cv2.StereoBM."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import LiteStereoError, SettingsError, UnsupportedError
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.devices.stereo_bm import PREFILTER_NORMALIZED_RESPONSE, StereoBM, StereoBM_create
from support.opencv import defined_region
from support.pairs import generator, textured_pair
from support.settings import drawn_settings

#: Methods of cv2's classes that have to do with files, and the factory.
FOREIGN = {"create", "read", "save", "write"}


def test_it_has_the_methods_and_the_defaults_of_cv2():
    ours, theirs = StereoBM_create(device="model:"), cv2.StereoBM_create()
    names        = {name for name in dir(cv2.StereoBM) if not name.startswith("_")} - FOREIGN
    assert names <= set(dir(StereoBM))
    getters = [name for name in sorted(names) if name.startswith("get")]
    assert len(getters) == 15
    for name in getters:
        if name not in ("getROI1", "getROI2"):
            assert getattr(ours, name)() == getattr(theirs, name)(), name
    for name in getters:
        if name not in ("getDefaultName", "getROI1", "getROI2"):
            for matcher in (ours, theirs):
                getattr(matcher, name.replace("get", "set"))(7)
            assert getattr(ours, name)() == getattr(theirs, name)(), name
    assert ours.getBlockSize() == 7
    ours.setROI1((1, 2, 3, 4))
    ours.setROI2((5, 6, 7, 8))
    assert (ours.getROI1(), ours.getROI2()) == ((1, 2, 3, 4), (5, 6, 7, 8))
    ours.clear()
    assert ours.empty() is theirs.empty() is False


def test_it_computes_what_cv2_computes():
    """One changed line: everything after it is the same for both."""
    rng = generator(45)
    for _ in range(40):
        settings    = drawn_settings(rng, largest_block=15, largest_range=48)
        width       = settings.minimum_size[0] + int(rng.integers(30, 60))
        left, right = textured_pair(width, settings.block_size + 20, rng, int(rng.integers(1, 12)))
        # Smooth images have larger islands.
        left, right = (cv2.GaussianBlur(image, (7, 7), 0) for image in (left, right))
        speckle     = int(rng.choice([0, 20, 200])), int(rng.choice([0, 4, 32, -1]))
        maps        = []
        for matcher in (StereoBM_create(settings.disparities, settings.block_size, device="model:"),
                        cv2.StereoBM_create(settings.disparities, settings.block_size)):
            matcher.setMinDisparity(settings.min_disparity)
            matcher.setPreFilterCap(settings.prefilter_cap)
            matcher.setTextureThreshold(settings.texture_threshold)
            matcher.setUniquenessRatio(settings.uniqueness_ratio)
            matcher.setDisp12MaxDiff(settings.disp12_max_diff)
            matcher.setSpeckleWindowSize(speckle[0])
            matcher.setSpeckleRange(speckle[1])
            maps.append(matcher.compute(left, right))
        region = defined_region(left.shape, settings)
        assert maps[0].dtype == maps[1].dtype == np.int16
        assert np.array_equal(maps[0][region], maps[1][region]), (settings, speckle)


def test_an_open_device_stays_open():
    left, right = textured_pair(120, 40, generator(46))
    with connect("model:") as device:
        with StereoBM_create(64, 9, device=device) as matcher:
            first = matcher.compute(left, right)
        assert np.array_equal(device.compute(left, right).disparity, first)
    with StereoBM(device="model:", num_disparities=0) as matcher:
        assert matcher.getNumDisparities() == 64
        assert matcher.compute(left, right).shape == (40, 120)
        matcher.close()
        assert matcher.compute(left, right).shape == (40, 120)


@pytest.mark.parametrize(("setter", "value", "error", "text"), [
    ("setPreFilterType", PREFILTER_NORMALIZED_RESPONSE, UnsupportedError, "PREFILTER_XSOBEL"),
    ("setROI1", (0, 0, 9, 9), UnsupportedError, "cut the map"),
    ("setNumDisparities", 17, SettingsError, "multiple of 16"),
    ("setBlockSize", 8, SettingsError, "odd"),
    ("setPreFilterCap", 64, SettingsError, "prefilter cap"),
    ("setMinDisparity", -1, SettingsError, "min disparity"),
    ("setUniquenessRatio", 101, SettingsError, "uniqueness ratio"),
    ("setSpeckleWindowSize", -1, SettingsError, "speckle window"),
])
def test_what_is_not_there_is_refused_by_compute(setter, value, error, text):
    matcher = StereoBM_create(device="model:")
    getattr(matcher, setter)(value)
    image = np.zeros((40, 120), np.uint8)
    with pytest.raises(error, match=text):
        matcher.compute(image, image)


def test_numbers_are_whole():
    with pytest.raises(SettingsError, match="whole number"):
        StereoBM_create(device="model:").setBlockSize(9.5)


def test_a_device_that_is_not_there():
    image = np.zeros((40, 120), np.uint8)
    with pytest.raises(LiteStereoError):
        StereoBM_create(device="tcp://127.0.0.1:1").compute(image, image)
