#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs are found in the folders of the usual data sets."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.calib_txt import read_calib
from litestereo.host_tools.core.errors import DatasetError, GeometryError
from litestereo.host_tools.data.layouts import find_samples
from support import data_sets
from support.data_sets import HEIGHT, SHIFT, WIDTH

#: Known pixels: all but the last column, see `data_sets.everywhere`.
KNOWN = (WIDTH - 1)*HEIGHT


def loaded(*folders, scale=None):
    """The only pair there, with what is in it."""
    (files,) = find_samples(folders, scale)
    sample   = files.load()
    left, right = data_sets.pair(0)
    assert np.array_equal(sample.left, left) and np.array_equal(sample.right, right)
    assert set(np.unique(sample.truth[:, :-1])) == {SHIFT} and np.isnan(sample.truth[:, -1]).all()
    assert sample.regions["all"].sum() == KNOWN and not sample.regions["disc"].any()
    return files, sample


def test_the_own_layout(tmp_path):
    files, sample = loaded(data_sets.litestereo(tmp_path / "pair"))
    assert (files.name, files.ndisp) == ("pair", None)
    assert set(sample.regions) == {"all", "disc"}
    data_sets.write(tmp_path / "pair", {"nonocc.png": data_sets.everywhere(255, np.uint8),
                                        "disc.png": data_sets.everywhere(128, np.uint8)})
    assert set(loaded(tmp_path / "pair")[1].regions) == {"all", "nonocc", "disc"}


def test_middlebury_2014(tmp_path):
    files, sample = loaded(data_sets.middlebury_2014(tmp_path / "Motorcycle"))
    assert (files.name, files.ndisp) == ("Motorcycle", 20)
    assert sample.regions["nonocc"].sum() == (WIDTH - 41)*HEIGHT
    assert not sample.regions["nonocc"][:, :40].any()


def test_middlebury_v2(tmp_path):
    files, sample = loaded(data_sets.middlebury_v2(tmp_path / "venus"))
    assert files.scale == 8
    # The right truth's last column is unknown, and the left one's first columns are outside of the right image.
    assert sample.regions["nonocc"].sum() == (WIDTH - 1 - SHIFT)*HEIGHT
    assert loaded(tmp_path / "venus", scale=8.0)[0].scale == 8


@pytest.mark.parametrize(("width", "scale"), [(450, 4), (900, 2), (1800, 1), (384, 16), (434, 8)])
def test_scales_of_middlebury_v2(tmp_path, width, scale):
    image = np.full((5, width), 64, np.uint8)
    data_sets.write(tmp_path / "a", {"imL.png": image, "imR.png": image, "truedisp.pgm": image})
    (files,) = find_samples([tmp_path / "a"])
    assert np.unique(files.load().truth).tolist() == [64/scale]


@pytest.mark.parametrize("names", [("image_2", "image_3", "disp_occ_0", "disp_noc_0"),
                                   ("image_0", "image_1", "disp_occ_0", "disp_noc_0"),
                                   ("colored_0", "colored_1", "disp_occ", "disp_noc"),
                                   ("image_0", "image_1", "disp_occ", "disp_noc")])
def test_kitti(tmp_path, names):
    for root in (data_sets.kitti(tmp_path, names=names), tmp_path / "training"):
        first, second = find_samples([root])
        assert (first.name, second.name) == ("000000_10", "000001_10")
        sample = first.load()
        assert sample.truth[0, 0] == SHIFT and sample.regions["nonocc"].sum() == (WIDTH - 61)*HEIGHT


def test_a_folder_of_pairs_of_several_kinds(tmp_path):
    data_sets.middlebury_v2(tmp_path / "set" / "c")
    data_sets.middlebury_2014(tmp_path / "set" / "b")
    data_sets.litestereo(tmp_path / "set" / "a")
    (tmp_path / "set" / "empty").mkdir()
    assert [files.name for files in find_samples([tmp_path / "set"])] == ["a", "b", "c"]
    assert [files.name for files in find_samples([tmp_path / "set" / "b", tmp_path / "set" / "a"])] == ["b", "a"]
    data_sets.litestereo(tmp_path / "other" / "a")
    names = [files.name for files in find_samples([tmp_path / "set", tmp_path / "other"])]
    assert names == ["set/a", "b", "c", "other/a"]


def test_what_is_no_data_set(tmp_path):
    with pytest.raises(DatasetError, match="no such folder"):
        find_samples([tmp_path / "none"])
    with pytest.raises(DatasetError, match="no stereo pair"):
        find_samples([tmp_path])


def test_files_of_different_sizes(tmp_path):
    folder = data_sets.middlebury_2014(tmp_path / "a")
    for name in ("im1.png", "mask0nocc.png"):
        image = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
        data_sets.write(folder, {name: image[1:]})
        with pytest.raises(DatasetError, match=f"{name}: is 120x49 pixels, the left image of the pair 120x50"):
            find_samples([folder])[0].load()
        data_sets.write(folder, {name: image})


def test_calib(tmp_path):
    (tmp_path / "calib.txt").write_text(data_sets.CALIB)
    calib    = read_calib(tmp_path / "calib.txt")
    geometry = calib.geometry
    assert (geometry.width, geometry.height, calib.ndisp) == (120, 50, 20)
    assert (geometry.focal_px, geometry.cx_left_px, geometry.cy_px, geometry.cx_right_px) == (500.5, 60.25, 24.5, 63.5)
    assert geometry.baseline_m == pytest.approx(0.1205)
    assert geometry.zero_px == -3.25     # Minus doffs.
    for old, new in (("cam1", "cam2"), ("cam0=[500.5", "cam0=[x"), ("baseline=120.5", ""), ("ndisp=20", "ndisp=1 2")):
        (tmp_path / "calib.txt").write_text(data_sets.CALIB.replace(old, new))
        with pytest.raises(GeometryError, match=f"'{old[:4]}.*is missing"):
            read_calib(tmp_path / "calib.txt")


def test_hidden_files_and_missing_images_of_kitti(tmp_path):
    """Files of a file manager are no truths; a truth without its images would be left out of the means."""
    root = data_sets.kitti(tmp_path) / "training"
    expected = [sample.name for sample in find_samples([root])]
    for folder in ("image_2", "image_3", "disp_occ_0"):
        (root / folder / "._000000_10.png").write_bytes(b"\0\5\x16\7")
    (root / ".hidden").mkdir()
    assert [sample.name for sample in find_samples([root])] == expected
    names = sorted(path.name for path in (root / "disp_occ_0").glob("[!.]*.png"))
    (root / "disp_occ_0" / "000099_10.png").write_bytes((root / "disp_occ_0" / names[0]).read_bytes())
    with pytest.raises(DatasetError, match="000099_10.png: has no images in image_2 and image_3"):
        find_samples([root])


def test_a_pair_that_is_given_twice_is_one(tmp_path):
    for place in ("a/x/teddy", "b/x/teddy", "c/teddy"):
        grey = np.zeros((9, 9), np.uint8)
        data_sets.write(tmp_path / place, {"left.png": grey, "right.png": grey,
                                           "disp_left_u16.png": grey.astype(np.uint16)})
    one = find_samples([tmp_path / "c" / "teddy", tmp_path / "c", tmp_path / "c" / "teddy" / ".." / "teddy"])
    assert [sample.name for sample in one] == ["teddy"]
    names = [sample.name for sample in find_samples([tmp_path / name / "x" for name in "ab"] + [tmp_path / "c"])]
    assert len(set(names)) == 3 and "c/teddy" in names
