#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the values of a map's file mean, and which mean none: the same for all commands."""

import cv2
import numpy as np
import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.images import pfm_of
from litestereo.host_tools.data.consistency import agreeing_scale, difference, is_upside_down
from litestereo.host_tools.data.map_files import read_map, read_truth
from support.data import FOLDERS, stereo_folder, stereo_pair
from support.pairs import SEED, generator, textured_pair

HEIGHT, WIDTH = 12, 80


def thorough(test):
    return seed(SEED)(settings(max_examples=200, deadline=None, database=None)(test))


def map_of(min_disparity=0, salt=0, whole=False, height=HEIGHT, width=WIDTH):
    """A map in pixels as a block matcher makes it, nan where there is none: at the border, and here and there."""
    rng    = generator(120, salt)
    pixels = min_disparity + rng.integers(1, 16*30, (height, width))/np.float32(1 if whole else 16)
    pixels = np.minimum(pixels, min_disparity + 31).astype(np.float32)
    pixels[rng.random(pixels.shape) < 0.2] = np.nan
    for line in (pixels[:2], pixels[-2:], pixels[:, :3].T, pixels[:, -2:].T):
        line[:] = np.nan
    return pixels


def write(path, array):
    """Write an array in the format of the file's ending."""
    if path.suffix == ".npy":
        np.save(path, array)
    elif path.suffix == ".npz":
        np.savez_compressed(path, array)
    elif path.suffix == ".pfm":
        path.write_bytes(pfm_of(array.astype(np.float32)))
    else:
        assert cv2.imwrite(str(path), array)
    return path


def filled(pixels, value):
    """The map with a value for none."""
    return np.where(np.isnan(pixels), np.float32(value), pixels)


@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.pfm", "a.tiff"])
@pytest.mark.parametrize("min_disparity", [0, 1, 16, 100])
@pytest.mark.parametrize("none", [np.nan, np.inf, -np.inf, -1, -16, -0.0625, 0, "below", "below by 2", -1e9, -3.4e38])
def test_floats_of_other_programs(name, min_disparity, none, tmp_path):
    pixels = map_of(min_disparity, width=200)
    value  = {"below": min_disparity - 1, "below by 2": min_disparity - 2}.get(none, none)
    read   = read_map(write(tmp_path / name, filled(pixels, value)), min_disparity)
    np.testing.assert_array_equal(read.pixels, pixels)
    assert read.usual == (not np.isfinite(value))
    if not read.usual:
        (note,) = read.notices
        assert note == (f"{tmp_path}/{name}: read as float32 in {'an image' if name == 'a.tiff' else name[1:]}, in "
                        f"pixels; {np.isnan(pixels).sum()} pixels without a disparity (values {np.float32(value):g})")


@thorough
@given(min_disparity=st.integers(0, 40), none=st.floats(-1000, 1000, width=32), salt=st.integers(0, 1 << 30),
       kind=st.sampled_from(["f2", "f4", "f8", ">f4"]))
def test_any_value_below_is_none_and_none_above(tmp_path_factory, min_disparity, none, salt, kind):
    """A value in the range is refused, or is a disparity: the others are never lost."""
    pixels = map_of(min_disparity, salt)
    value  = float(np.array(none, kind))
    path   = write(tmp_path_factory.mktemp("map") / "a.npy", filled(pixels, value).astype(kind))
    try:
        read = read_map(path, min_disparity)
    except ImageError as error:
        assert value >= min_disparity and ("--min-disparity" in str(error) or "--map-scale" in str(error)
                                           or "--none-value" in str(error))
        return
    known = np.isfinite(pixels)
    np.testing.assert_allclose(read.pixels[known], pixels[known], rtol=1e-3)
    assert np.isnan(read.pixels[~known]).all() if value < min_disparity else value >= min_disparity


@pytest.mark.parametrize("min_disparity", [0, 1, 16])
def test_int16_is_sixteenths_for_all(min_disparity, tmp_path):
    pixels = map_of(min_disparity)
    raw    = filled(16*pixels, 16*(min_disparity - 1)).astype(np.int16)
    for name in ("a.npy", "a.npz"):
        for array in (raw, raw.astype(">i2"), np.asfortranarray(raw)):
            path = write(tmp_path / name, array)
            read = read_map(path, min_disparity)
            np.testing.assert_array_equal(read.pixels, pixels)
            assert read.usual
            truth = read_truth(path)
            np.testing.assert_array_equal(truth.pixels, pixels)
            assert truth.notices and "in sixteenths of a pixel" in truth.note
    if min_disparity:
        with pytest.raises(ImageError, match=f"matched with --min-disparity {min_disparity}, not 0: give that"):
            read_map(path, 0)
        floats = write(tmp_path / "f.npy", filled(pixels, min_disparity - 1))
        if min_disparity > 1: # Else its 0 means none to begin with.
            with pytest.raises(ImageError, match=f"matched with --min-disparity {min_disparity}, not 0: give that"):
                read_map(floats, 0)
        np.testing.assert_array_equal(read_map(floats, 0 if min_disparity == 1 else min_disparity).pixels, pixels)


def test_a_smallest_disparity_below_0_is_said(tmp_path):
    path = write(tmp_path / "a.npy", filled(16*map_of(), -16*17).astype(np.int16))
    with pytest.raises(ImageError, match="--min-disparity -16, not 0: add 16 pixels to its disparities"):
        read_map(path)


def test_16_bit_images_are_256ths_for_all(tmp_path):
    pixels = map_of()
    path   = write(tmp_path / "a.png", np.nan_to_num(256*pixels).astype(np.uint16))
    for read in (read_map(path), read_truth(path)):
        np.testing.assert_array_equal(read.pixels, pixels)
        assert read.usual
    for scale in (128.0, 256.0, 3.0):
        read = read_truth(path, scale)
        np.testing.assert_allclose(read.pixels, pixels*np.float32(256/scale), rtol=1e-6)


def test_full_scale_of_an_image_may_mean_none(tmp_path):
    values       = np.nan_to_num(256*map_of(width=300)).astype(np.uint16)
    values[6, 6] = 65534
    assert np.nanmax(read_map(write(tmp_path / "a.png", values)).pixels) == np.float32(65534/256)
    values[6, 6] = 65535
    with pytest.raises(ImageError, match="has 1 pixels of 65535.* give --none-value 65535 for none, or"):
        read_map(write(tmp_path / "a.png", values))
    assert np.isnan(read_map(tmp_path / "a.png", none_values=[65535]).pixels[6, 6])
    assert read_map(tmp_path / "a.png", none_values=[np.nan]).pixels[6, 6] == np.float32(65535/256)


def test_more_values_below_are_refused_and_decided_by_an_option(tmp_path):
    pixels        = filled(map_of(16), -1)
    pixels[0, :5] = 0
    path          = write(tmp_path / "a.npy", pixels)
    with pytest.raises(ImageError, match="has 2 values below the smallest disparity 16, from -1 to 0: give the --min"):
        read_map(path, 16)
    np.testing.assert_array_equal(read_map(path, 16, none_values=[-1, 0]).pixels, map_of(16))
    pixels[0, 0] = -0.1
    np.testing.assert_array_equal(read_map(write(path, pixels), 16, none_values=[-1, 0, -0.1]).pixels, map_of(16))
    assert read_map(path, 16, none_values=[np.nan]).note.endswith("; 0 pixels without a disparity")


def test_zeros_that_may_be_disparities_are_refused(tmp_path):
    pixels = filled(map_of(), 5)
    assert np.isfinite(read_map(write(tmp_path / "dense.npy", pixels + 0.5)).pixels).all()
    pixels[5, 5:8] = 0
    pixels[0, 0]   = 3.25
    path           = write(tmp_path / "a.npy", pixels)
    with pytest.raises(ImageError, match="has 3 pixels of 0, which may mean .* give --none-value 0 for none, or"):
        read_map(path)
    assert np.isnan(read_map(path, none_values=[0]).pixels).sum() == 3
    assert np.isfinite(read_map(path, none_values=[np.nan]).pixels).all()
    # So it is in sixteenths.
    with pytest.raises(ImageError, match="has 3 pixels of 0, which may mean"):
        read_map(write(path, (16*pixels).astype(np.int16)))
    assert np.isnan(read_map(path, none_values=[0]).pixels).sum() == 3
    # With another mark 0 is a disparity.
    for mark in (np.nan, np.inf, -1):
        pixels[0, 0] = mark
        assert np.isnan(read_map(write(path, pixels)).pixels).sum() == 1


def test_floats_in_sixteenths_are_refused(tmp_path):
    raw  = filled(16*map_of(), -16)
    path = write(tmp_path / "a.npy", raw)
    with pytest.raises(ImageError, match="sixteenths of a pixel, as cv2.StereoBM returns it: give --map-scale 16"):
        read_map(path)
    np.testing.assert_array_equal(read_map(path, scale=16).pixels, map_of())


def test_no_disparity_reaches_the_width(tmp_path):
    pixels = map_of()
    for most, refused in ((WIDTH - 1, False), (WIDTH - 0.0625, False), (WIDTH, True), (1e30, True)):
        pixels[6, 6] = most
        path         = write(tmp_path / "a.npy", pixels)
        if refused:
            with pytest.raises(ImageError, match=f"more than its width of {WIDTH}: give --map-scale"):
                read_map(path)
        else:
            assert np.nanmax(read_map(path).pixels) == most


@pytest.mark.parametrize("kind", ["u1", "u2", "u4", "i1", "i4", "i8", "u8"])
def test_whole_numbers_need_a_scale(kind, tmp_path):
    values = np.nan_to_num(map_of(whole=True)).astype(kind)
    path   = write(tmp_path / "a.npy", values)
    with pytest.raises(ImageError, match="int16 .* --map-scale with the divisor"):
        read_map(path)
    read = read_truth(path, 2.0)
    np.testing.assert_array_equal(read.pixels, np.where(values == 0, np.nan, values.astype(np.float32)/2))
    if kind == "u1":
        assert "in pixels" in read_truth(path).notices[0]
    else:
        with pytest.raises(ImageError, match=f"whole numbers of type {values.dtype}, whose scale is not known: give"):
            read_truth(path)


def test_grey_in_three_channels(tmp_path):
    grey = np.nan_to_num(map_of(whole=True)).astype(np.uint8)
    path = write(tmp_path / "a.png", np.dstack([grey]*3))
    assert np.array_equal(np.nan_to_num(read_truth(path, 4.0).pixels), np.float32(grey)/4)
    path = write(path, np.dstack([grey, grey, grey + 1]))
    with pytest.raises(ImageError, match="one number per pixel"):
        read_truth(path)
    with pytest.raises(ImageError, match="grey image of 16 bits"):
        read_map(write(path, grey))
    assert np.array_equal(np.nan_to_num(read_map(path, scale=4.0).pixels), np.float32(grey)/4)


@pytest.mark.parametrize("kind", [".npy", ".npz", ".pfm", ".png"])
@pytest.mark.parametrize("read", [read_map, read_truth])
def test_what_is_no_map_is_one_line(kind, read, tmp_path):
    path = tmp_path / f"a{kind}"
    for data in (b"", b"nonsense", b"\x93NUMPY\1\0", b"PK\3\4", b"Pf\n1 1\n-1\n", b"\x89PNG\r\n\x1a\n"):
        path.write_bytes(data)
        with pytest.raises(ImageError) as caught:
            read(path)
        assert str(caught.value).isprintable()
    for array in (np.zeros((0, 4), np.int16), np.zeros(4, np.int16), np.zeros((2, 2), complex), np.zeros((2, 2), bool)):
        if kind in (".npy", ".npz"):
            with pytest.raises(ImageError, match="one number per pixel"):
                read(write(path, array))


# What the images say
# -------------------

@pytest.mark.parametrize("scale", [1, 2, 3, 4, 8, 16])
@pytest.mark.parametrize("shift", [3, 7, 15])
def test_the_scale_that_the_images_agree_with(scale, shift, tmp_path):
    left, right = textured_pair(160, 60, generator(121), shift)
    values      = np.full(left.shape, scale*shift, np.float32)
    found       = agreeing_scale(left, right, values)
    assert found == scale or (found is None and shift*scale < 100)
    assert found == scale or shift == 3
    path  = write(tmp_path / "a.png", values.astype(np.uint8))
    read  = read_truth(path)
    if scale == 1:
        assert read.agreeing(left, right, "--ground-truth-scale") is read
    elif found:
        with pytest.raises(ImageError, match=f"the images agree with {scale}: give --ground-truth-scale {scale}, or"):
            read.agreeing(left, right, "--ground-truth-scale")


def test_nothing_is_certain_without_texture_or_with_noise():
    flat  = np.full((60, 160), 90, np.uint8)
    noise = [generator(122, salt).integers(0, 256, (60, 160), np.uint8) for salt in range(2)]
    value = np.full((60, 160), 40, np.float32)
    for pair in ((flat, flat), noise):
        assert agreeing_scale(*pair, value) is None
        assert not is_upside_down(*pair, value)
    left, right = textured_pair(160, 60, generator(123), 7)
    assert agreeing_scale(left, right, np.full((60, 160), np.nan, np.float32)) is None
    few        = np.full((60, 160), np.nan, np.float32)
    few[:, 80] = 56
    assert agreeing_scale(left, right, few) is None and difference(left, right, few) == np.inf


@pytest.mark.parametrize("name", FOLDERS)
def test_published_pairs_agree_with_their_scales(name):
    pair   = stereo_pair(name)
    scale  = {"tsukuba": 16, "venus": 8, "teddy": 4, "cones": 4}[name]
    folder = stereo_folder(name)
    for file, divisor in (("disp_left.png", scale), ("disp_left_u16.png", 256)):
        values = read_truth(folder / file, 1.0).pixels
        assert agreeing_scale(pair.left, pair.right, values) == divisor
        read   = read_truth(folder / file, float(divisor))
        assert read.agreeing(pair.left, pair.right, "--ground-truth-scale") is read


def test_rows_of_photoshop_are_those_that_the_images_have(tmp_path):
    """The header says from the top; other programs write it so too, with rows from the bottom."""
    left, right = textured_pair(160, 60, generator(124), 4)
    other       = textured_pair(160, 60, generator(125), 12)
    truth       = np.full((60, 160), 4, np.float32)
    truth[30:]  = 12
    left[30:], right[30:] = other[0][30:], other[1][30:]
    path        = tmp_path / "a.pfm"
    for rows, said in ((truth, "rows from the top, as Photoshop"), (truth[::-1], "rows from the bottom, as the")):
        path.write_bytes(b"Pf\n160\n60\n-1.0\n" + rows.astype("<f4").tobytes())
        read = read_truth(path).agreeing(left, right, "--ground-truth-scale")
        np.testing.assert_array_equal(read.pixels, truth)
        assert said in read.notices[0]
