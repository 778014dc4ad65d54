#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images in, disparity maps out, and ground truth."""

import re

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.images import (
    color_image,
    disparity_pixels,
    encode_pfm,
    kitti_image,
    read_grey,
    write_disparity,
)
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.data.ground_truth import decode_pfm, read_ground_truth
from support.data import stereo_folder, stereo_pair
from support.pairs import generator

MAP = np.array([[-16, 0, 16], [24, 1008, -16]], np.int16)


def png(path, image):
    assert cv2.imwrite(str(path), image)
    return path


def test_grey_is_read_as_it_is(tmp_path):
    image = generator(10).integers(0, 256, (17, 23), np.uint8)
    pixels, notices = read_grey(png(tmp_path / "grey.png", image))
    assert np.array_equal(pixels, image)
    assert notices == []


def test_colour_becomes_luma_with_a_notice(tmp_path):
    colors = np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]], np.uint8)
    for image in (colors, np.dstack([colors, np.full((1, 4), 255, np.uint8)])):
        path = png(tmp_path / "color.png", image)
        pixels, (notice,) = read_grey(path)
        assert pixels.tolist() == cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).tolist() == [[29, 149, 76, 255]]
        assert "colour" in notice and "color.png" in notice


def test_16_bits_become_the_upper_8_with_a_notice(tmp_path):
    pixels, (notice,) = read_grey(png(tmp_path / "deep.png", np.array([[0, 255, 256, 65535]], np.uint16)))
    assert pixels.tolist() == [[0, 0, 1, 255]]
    assert "16-bit" in notice


@pytest.mark.parametrize("content", [b"", b"no image", b"\x89PNG\r\n\x1a\n", None])
def test_what_is_no_image_is_refused_in_one_line(tmp_path, content, capfd):
    path = tmp_path / "bad.png"
    if content is None:
        png(path, generator(11).integers(0, 256, (50, 50), np.uint8))
        content = path.read_bytes()[:900]
    path.write_bytes(content)
    with pytest.raises(ImageError, match=r"bad\.png: is not an image"):
        read_grey(path)
    assert capfd.readouterr().err == ""


def test_missing_files_and_folders_are_refused(tmp_path):
    with pytest.raises(ImageError, match="no such file"):
        read_grey(tmp_path / "none.png")
    with pytest.raises(ImageError, match="cannot be read"):
        read_grey(tmp_path)


def test_float_images_are_refused(tmp_path):
    with pytest.raises(ImageError, match="float32"):
        read_grey(png(tmp_path / "deep.tiff", np.ones((4, 4), np.float32)))


def test_pfm_is_that_of_middlebury():
    """Read back by OpenCV, and by hand: the bottom row first."""
    data = encode_pfm(MAP)
    assert data.startswith(b"Pf\n3 2\n-1.0\n")
    values = np.frombuffer(data[len(b"Pf\n3 2\n-1.0\n"):], "<f4")
    assert values.tolist() == [1.5, 63.0, np.inf, np.inf, 0.0, 1.0]
    assert np.array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED),
                          [[np.inf, 0, 1], [1.5, 63, np.inf]])


def test_kitti_image_keeps_valid_apart_from_invalid():
    assert kitti_image(MAP).tolist() == [[0, 1, 256], [384, 16128, 0]]
    assert kitti_image(np.array([[32767]], np.int16)).tolist() == [[65535]]


def test_color_image_goes_from_blue_to_red_and_is_black_where_there_is_nothing():
    color = color_image(MAP, MatcherSettings(64))
    assert color.shape == (2, 3, 3)
    assert color[0, 0].tolist() == color[1, 2].tolist() == [0, 0, 0]
    assert color[0, 1].any()
    near, far = color[1, 1].astype(int), color[0, 2].astype(int)
    assert near[2] > near[0]
    assert far[0] > far[2] or far[0] > 50


def test_written_files_are_what_they_say(tmp_path):
    rng   = generator(12)
    map_  = rng.integers(-1, 1024, (20, 30)).astype(np.int16)
    map_[map_ < 0] = -16
    paths = write_disparity(tmp_path / "new" / "folder", map_, MatcherSettings(64))
    assert [path.name for path in paths] == ["disparity.npy", "disparity.pfm", "disparity.png",
                                             "disparity_color.png"]
    assert np.array_equal(np.load(paths[0]), map_)
    assert np.load(paths[0]).dtype == np.int16
    expected = np.where(map_ > 0, map_/16, np.nan).astype(np.float32)
    for path in paths[1:3]:
        truth = read_ground_truth(path)
        known = map_ > 0
        assert np.array_equal(truth[known], expected[known])
        assert np.isnan(truth[map_ < 0]).all()
    assert cv2.imread(str(paths[3])).shape == (20, 30, 3)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ImageError, match="cannot be written"):
        write_disparity(tmp_path / "file" / "out", MAP, MatcherSettings(64))


def test_ground_truth_of_all_kinds(tmp_path):
    png(tmp_path / "eight.png", np.array([[0, 4, 255]], np.uint8))
    png(tmp_path / "sixteen.png", np.array([[0, 256, 384]], np.uint16))
    np.save(tmp_path / "truth.npy", np.array([[np.nan, np.inf, -1.0, 0.0, 2.5]], np.float32))
    np.savez(tmp_path / "truth.npz", np.array([[np.inf, 7.25]], np.float32))
    (tmp_path / "truth.pfm").write_bytes(b"Pf\n2 1\n1.0\n" + np.array([3.5, np.inf], ">f4").tobytes())
    nan = np.nan
    for name, scale, expected in (
        ("eight.png", 4, [[nan, 1, 63.75]]),
        ("eight.png", None, [[nan, 4, 255]]),
        ("sixteen.png", None, [[nan, 1, 1.5]]),
        ("sixteen.png", 128, [[nan, 2, 3]]),
        ("truth.npy", None, [[nan, nan, nan, nan, 2.5]]),
        ("truth.npz", None, [[nan, 7.25]]),
        ("truth.pfm", None, [[3.5, nan]]),
    ):
        truth = read_ground_truth(tmp_path / name, scale)
        assert truth.dtype == np.float32
        np.testing.assert_array_equal(truth, np.array(expected, np.float32), name)


@pytest.mark.parametrize(("name", "content"), [
    ("a.npy", b""),
    ("a.npy", b"nonsense"),
    ("a.npz", b"PK\3\4nonsense"),
    ("a.png", b"nonsense"),
    ("a.pfm", b""),
    ("a.pfm", b"Pf\n9 9\n-1.0\nshort"),
    ("a.pfm", b"PF\n1 1\n-1.0\n" + bytes(12)),
    ("a.pfm", b"Pf\nx y\n-1.0\n"),
    ("a.pfm", b"Pf\n0 0\n-1\n"),
])
def test_damaged_ground_truth_is_refused_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ImageError) as caught:
        read_ground_truth(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_improper_ground_truth_is_refused(tmp_path):
    np.save(tmp_path / "cube.npy", np.zeros((2, 2, 2)))
    np.save(tmp_path / "objects.npy", np.array([[{}]]), allow_pickle=True)
    np.save(tmp_path / "text.npy", np.array([["a"]]))
    for name in ("cube.npy", "objects.npy", "text.npy", "missing.npy"):
        with pytest.raises(ImageError):
            read_ground_truth(tmp_path / name)
    np.save(tmp_path / "fine.npy", np.ones((2, 2)))
    for scale in (0, -1, np.nan, np.inf):
        with pytest.raises(ImageError, match="scale"):
            read_ground_truth(tmp_path / "fine.npy", scale)


def test_pfm_comes_back():
    decoded = decode_pfm(encode_pfm(MAP), "map")
    assert np.array_equal(decoded, [[np.inf, 0, 1], [1.5, 63, np.inf]])


@pytest.mark.parametrize(("name", "size"), [
    ("tsukuba", (288, 384)),
    ("venus", (383, 434)),
    ("teddy", (375, 450)),
    ("cones", (375, 450)),
])
def test_middlebury_pairs(name, size):
    pair   = stereo_pair(name)
    folder = stereo_folder(name)
    scale  = float(re.search(r'"gt_scale": (\d+)', (folder / "meta.json").read_text())[1])
    assert pair.left.shape == pair.right.shape == pair.truth.shape == size
    np.testing.assert_array_equal(read_ground_truth(folder / "disp_left.png", scale), pair.truth)


def test_a_smallest_disparity_moves_the_value_of_pixels_without_one():
    settings = MatcherSettings(16, 5, min_disparity=2)
    map_     = np.array([[16, 17, 32], [0, 200, 16]], np.int16)
    assert settings.invalid == 16
    assert np.array_equal(np.isnan(disparity_pixels(map_, settings.invalid)), map_ <= 16)
    assert np.array_equal(kitti_image(map_, settings.invalid) == 0, map_ <= 16)
    assert np.array_equal((color_image(map_, settings) == 0).all(axis=2), map_ <= 16)
