#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Disparity maps read back, and the window in which they can be valid, against OpenCV and the reference model."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError, SettingsError
from litestereo.host_tools.core.images import disparity_pixels, write_disparity
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.export.maps import SearchRange, read_disparity
from support.pairs import generator, textured_pair

CASES = [(64, 0, 9), (16, 0, 5), (16, 5, 7), (48, 16, 21)]


@pytest.mark.parametrize(("disparities", "min_disparity", "block_size"), CASES)
def test_the_window_is_that_of_opencv(disparities, min_disparity, block_size):
    whole = (0, 0, 200, 60)
    assert SearchRange(disparities, min_disparity, block_size).window(200, 60) == cv2.getValidDisparityROI(
        whole, whole, min_disparity, disparities, block_size)


@pytest.mark.parametrize(("disparities", "min_disparity", "block_size"), CASES)
def test_the_window_is_where_the_model_has_disparities(disparities, min_disparity, block_size):
    shift       = min_disparity + 3
    left, right = textured_pair(140, 50, generator(80), shift)
    settings    = MatcherSettings(disparities, block_size, min_disparity, texture_threshold=0, uniqueness_ratio=0)
    with connect("model:") as device:
        map_ = device.compute(left, right, settings).disparity
    valid  = map_ > settings.invalid
    search = SearchRange(disparities, min_disparity, block_size)
    search.check(disparity_pixels(map_, settings.invalid))
    x, y, width, height = search.window(140, 50)
    expected = np.zeros(valid.shape, bool)
    expected[y:y + height, x:x + width] = True
    assert np.array_equal(valid, expected)


def test_images_without_any_valid_pixel():
    assert SearchRange(64, 0, 9).window(50, 50)[2] == 0
    assert SearchRange(16, 0, 21).window(100, 20)[1:] == (10, 80 - 15, 0)


def test_what_cannot_be_of_a_range():
    search  = SearchRange(16, 4, 9)
    map_    = np.full((30, 60), np.nan, np.float32)
    map_[4, 23:56] = 10
    search.check(map_)
    for value in (3.9375, 19.0625):
        map_[10, 30] = value
        with pytest.raises(ImageError, match="out of range that were not searched: give the --disparities"):
            search.check(map_)
    map_[10, 30] = 19
    search.check(map_)
    for place in ((3, 30), (26, 30), (10, 22), (10, 56)):
        map_[place] = 10
        with pytest.raises(ImageError, match="at its border"):
            search.check(map_)
        map_[place] = np.nan
    for wrong in ({"block_size": 8}, {"disparities": 0}, {"min_disparity": -1}):
        with pytest.raises(SettingsError):
            SearchRange(**wrong)


def test_what_match_writes_is_read(tmp_path):
    settings = MatcherSettings(16, 9, 3)
    map_     = generator(81).integers(settings.invalid + 1, 16*19, (20, 30)).astype(np.int16)
    map_[generator(82).random(map_.shape) < 0.2] = settings.invalid
    map_[0, 0] = settings.invalid
    write_disparity(tmp_path, map_, settings)
    expected = disparity_pixels(map_, settings.invalid)
    search   = SearchRange(min_disparity=3)
    for name in ("disparity.npy", "disparity.pfm", "disparity.png"):
        np.testing.assert_array_equal(read_disparity(tmp_path / name, search), expected)
    floats       = expected.astype(np.float64)
    floats[0, 1] = np.inf
    np.save(tmp_path / "floats.npy", floats)
    expected[0, 1] = np.nan
    np.testing.assert_array_equal(read_disparity(tmp_path / "floats.npy", search), expected)


def test_another_smallest_disparity_is_noticed(tmp_path):
    """Else what means none would be a disparity, and the other way round."""
    for min_disparity in (0, 16):
        map_       = np.full((20, 30), 16*(min_disparity - 1), np.int16)
        map_[5, 5] = 16*min_disparity + 5
        np.save(tmp_path / "map.npy", map_)
        assert np.isfinite(read_disparity(tmp_path / "map.npy", SearchRange(min_disparity=min_disparity))).sum() == 1
        with pytest.raises(ImageError, match=f"with --min-disparity {min_disparity}, not 8: give that"):
            read_disparity(tmp_path / "map.npy", SearchRange(min_disparity=8))
    map_[0, 0] = 16*16
    np.save(tmp_path / "cut.npy", map_)
    assert np.isfinite(read_disparity(tmp_path / "cut.npy", SearchRange(min_disparity=16))).sum() == 2


def test_what_is_no_map(tmp_path):
    cv2.imwrite(str(tmp_path / "grey.png"), np.zeros((4, 4), np.uint8))
    np.save(tmp_path / "counts.npy", np.zeros((4, 4), np.int32))
    np.save(tmp_path / "colour.npy", np.zeros((4, 4, 3), np.int16))
    np.savez(tmp_path / "several.npz", a=np.zeros((4, 4), np.int16))
    (tmp_path / "several.npz").rename(tmp_path / "several.npy")
    (tmp_path / "text.npy").write_text("no array")
    (tmp_path / "text.pfm").write_text("no map")
    for name, text in (("none.npy", "no such file"), ("grey.png", "grey image of 16 bits"), ("counts.npy", "int16"),
                       ("colour.npy", "int16"), ("several.npy", "int16"), ("text.npy", "NumPy"), ("text.pfm", "PFM")):
        with pytest.raises(ImageError, match=text):
            read_disparity(tmp_path / name, SearchRange())
