#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs are found in the folders of the usual data sets."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.calib_txt import read_calib
from litestereo.host_tools.core.errors import DatasetError, GeometryError, ImageError
from litestereo.host_tools.data.layouts import find_samples
from support import data_sets
from support.data_sets import HEIGHT, SHIFT, WIDTH
from support.images import with_orientation
from support.pairs import generator, textured_pair

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


def scaled_pair(folder, names, scale, size=(160, 60), shift=7, right_truth=True):
    """A pair of that size with 8-bit truths times `scale`; `names` are those of left, right and the truths."""
    left, right = textured_pair(*size, generator(130), shift)
    truth       = np.full(left.shape, round(scale*shift), np.uint8)
    images      = dict(zip(names, (left, right, truth, truth), strict=False))
    for name, image in list(images.items())[:4 if right_truth else 3]:
        data_sets.write(folder, {name: np.dstack([image]*3) if name.endswith(".ppm") else image})
    return folder


VIEWS   = ("view1.png", "view5.png", "disp1.png", "disp5.png")
OLD     = ("im2.ppm", "im6.ppm", "disp2.pgm", "disp6.pgm")
TSUKUBA = ("scene1.row3.col3.ppm", "scene1.row3.col4.ppm", "truedisp.row3.col3.pgm")


@pytest.mark.parametrize(("names", "size", "scale"), [
    (VIEWS, (427, 370), 3), (VIEWS, (465, 370), 3), (VIEWS, (641, 555), 2), (VIEWS, (1282, 1110), 1),
    (OLD, (450, 375), 4), (OLD, (900, 750), 2), (OLD, (1800, 1500), 1), (OLD, (434, 383), 8), (OLD, (430, 381), 8),
    (OLD, (284, 216), 8), (TSUKUBA, (384, 288), 16),
])
def test_published_sizes_have_their_scale_without_a_guess(names, size, scale, tmp_path):
    (files,) = find_samples([scaled_pair(tmp_path / "a", names, scale, size)])
    assert (files.scale, files.notes) == (scale, ())
    sample   = files.load()
    assert set(np.unique(sample.truth)) == {7} and ("nonocc" in sample.regions) == (len(names) == 4)
    (note,)  = sample.notes
    assert f"{scale} levels per pixel" in note or scale == 1


@pytest.mark.parametrize("names", [VIEWS, OLD, ("imL.png", "imR.png", "truedisp.png")])
@pytest.mark.parametrize("scale", [1, 2, 3, 4, 8, 16])
@pytest.mark.parametrize("size", [(160, 120), (449, 60), (451, 60)])
def test_other_sizes_have_the_scale_of_the_images_or_need_it(names, scale, size, tmp_path):
    (files,) = find_samples([scaled_pair(tmp_path / "a", names, scale, size)])
    levels   = f"{scale} level{'s'*(scale > 1)} per pixel"
    assert files.scale == scale and f"{levels} is what the images agree with" in files.notes[0]
    assert files.load().notes == files.notes
    # Without texture nothing agrees.
    for name in names[:2]:
        data_sets.write(tmp_path / "a", {name: np.full((*size[::-1], 3), 90, np.uint8)})
    with pytest.raises(DatasetError, match="scale is not known: give --ground-truth-scale"):
        find_samples([tmp_path / "a"])
    (files,) = find_samples([tmp_path / "a"], 5.0)
    assert files.scale == 5 and set(np.unique(files.load().truth)) == {np.float32(scale*7)/np.float32(5)}


def test_a_scale_that_the_images_contradict_is_refused(tmp_path):
    scaled_pair(tmp_path / "a", OLD, 8, (450, 60))
    with pytest.raises(ImageError, match="read as 4 levels per pixel, but the images agree with 8: give --ground"):
        find_samples([tmp_path / "a"])[0].load()
    assert set(np.unique(find_samples([tmp_path / "a"], 4.0)[0].load().truth)) == {14}


def test_a_truth_of_other_depth_has_the_scale_of_its_format(tmp_path):
    scaled_pair(tmp_path / "a", OLD, 1, right_truth=False)
    (tmp_path / "a" / "disp2.pgm").unlink()
    data_sets.write(tmp_path / "a", {"disp2.png": np.full((60, 160), 256*7, np.uint16)})
    (files,) = find_samples([tmp_path / "a"])
    assert files.scale is None and set(np.unique(files.load().truth)) == {7} and not files.load().notes


@pytest.mark.parametrize(("values", "inside"), [
    ((0, 255), 255), ((0, 128, 255), 255), ((0, 64, 128, 255), 255), ((255,), 255), ((0, 1), 1), ((1,), 1), ((0,), 255),
    ((0, 128), 255), ((128,), 255), ((0, 254), None), ((0, 1, 2), None), ((0, 1, 128), None), ((0, 100), None),
    ((2,), None), ((0, 60, 70, 80, 255), None), (tuple(range(256)), None),
])
def test_masks(values, inside, tmp_path):
    folder = data_sets.litestereo(tmp_path / "a")
    mask   = np.resize(np.array(values, np.uint8), (HEIGHT, WIDTH))
    for name in ("nonocc", "disc"):
        data_sets.write(folder, {f"{name}.png": mask})
        files = find_samples([folder])[0]
        if inside is None:
            with pytest.raises(ImageError, match=f"{name}.png: is no mask"):
                files.load()
        else:
            sample = files.load()
            assert np.array_equal(sample.regions[name], sample.regions["all"] & (mask == inside))
            assert len(sample.notes) == (inside == 1)
            data_sets.write(folder, {f"{name}.png": np.full_like(mask, 255)})
        (folder / f"{name}.png").unlink()


def test_pictures_that_are_turned_are_said(tmp_path):
    folder = data_sets.litestereo(tmp_path / "a")
    for name in ("left.png", "right.png"):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(with_orientation(data, 3))
    notes = find_samples([folder])[0].load().notes
    assert len(notes) == 2 and all("rotated or mirrored" in note for note in notes)
