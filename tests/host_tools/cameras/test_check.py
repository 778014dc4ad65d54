#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Numbers that no camera has, at and around each limit; numbers of real devices."""

import dataclasses

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.calib_txt import parse_calib
from litestereo.host_tools.cameras.camera_info import (
    CameraInfo,
    ideal_cameras,
    pair_geometry,
    read_camera_info,
    write_camera_info,
)
from litestereo.host_tools.cameras.rectify import Rectifier, read_calibration, write_calibration
from litestereo.host_tools.core.errors import GeometryError, ImageError
from litestereo.host_tools.core.geometry import StereoGeometry
from support.pairs import generator

GEOMETRY    = StereoGeometry(width=160, height=120, focal_px=140.0, baseline_m=0.06, cx_left_px=79.5, cy_px=59.5,
                             cx_right_px=79.5)
LEFT, RIGHT = ideal_cameras(GEOMETRY)


def changed(camera: CameraInfo, name: str, place: tuple[int, ...], value: float) -> CameraInfo:
    array        = getattr(camera, name).copy()
    array[place] = value
    return dataclasses.replace(camera, **{name: array})


@pytest.mark.parametrize("name", ["camera_matrix", "projection"])
@pytest.mark.parametrize(("place", "good", "bad"), [
    ((0, 0), (100.0, 3.2*50, 250.0), (0.0, -140.0, 3.1, 60.0, 290.0, 160_001.0)),
    ((1, 1), (71.0, 279.0), (0.0, -140.0, 69.0, 281.0)),
    ((0, 1), (0.0, 0.1, -0.1), (0.2, -0.2, 140.0)),
    ((1, 0), (0.0, 0.1, -0.1), (0.2, -0.2, 140.0)),
    ((2, 0), (1e-4, -1e-4), (0.01, 1.0)),
    ((2, 1), (1e-4, -1e-4), (0.01, 1.0)),
    ((2, 2), (1.0001, 0.9999), (0.0, 0.5, 1.01, 2.0, -1.0)),
    ((0, 2), (-60.0, 240.0), (-1600.0, 1700.0)),
    ((1, 2), (-60.0, 240.0), (-1600.0, 1700.0)),
])
def test_matrices(name, place, good, bad):
    for value in good:
        changed(LEFT, name, place, value)
    for value in (*bad, np.nan, np.inf, -np.inf):
        with pytest.raises(GeometryError, match=r"_matrix(\[\d\]\[\d\] is| has (nan|-?inf))") as error:
            changed(LEFT, name, place, value)
        assert "\n" not in str(error.value)


def test_a_camera_that_is_not_calibrated():
    for name in ("camera_matrix", "projection"):
        with pytest.raises(GeometryError, match="not calibrated"):
            dataclasses.replace(LEFT, **{name: 0*getattr(LEFT, name)})
    with pytest.raises(GeometryError, match="all 0"):
        dataclasses.replace(LEFT, rectification=np.zeros((3, 3)))


@pytest.mark.parametrize("number", range(20))
def test_rotations(number):
    """Any rotation, also rounded to three decimals; none that is sheared, scaled or mirrored by a hundredth."""
    rng           = generator(140, number)
    rotation      = cv2.Rodrigues(rng.normal(size=3)*rng.choice([0.01, 0.1, 1]))[0]
    for good in (rotation, np.round(rotation, 3), np.round(rotation, 6)):
        dataclasses.replace(LEFT, rectification=good)
    shear         = np.eye(3)
    place         = tuple(rng.choice(3, 2, replace=False))
    shear[place]  = rng.choice([-1, 1])*rng.uniform(0.01, 1)
    mirror        = np.diag(rng.permutation([1, 1, -1]))
    for bad in (rotation @ shear, 1.01*rotation, 0.99*rotation, mirror @ rotation, -rotation, 1e200*rotation):
        with pytest.raises(GeometryError, match=r"rectification_matrix is no rotation"):
            dataclasses.replace(LEFT, rectification=bad)


@pytest.mark.parametrize(("model", "counts"), [
    ("plumb_bob", {0, 4, 5}), ("rational_polynomial", {0, 8, 12, 14}), ("equidistant", {0, 4}),
    ("none", {0, 4, 5, 8, 12, 14}), ("", {0, 4, 5, 8, 12, 14}), ("odd", set()),
])
def test_numbers_of_coefficients(model, counts):
    for count in range(17):
        def camera(model=model, count=count):
            return dataclasses.replace(LEFT, distortion_model=model, distortion=np.zeros(count))
        if count in counts:
            # OpenCV takes each of them.
            assert Rectifier(camera(), RIGHT).geometry == pair_geometry(LEFT, RIGHT)
        else:
            with pytest.raises(GeometryError, match="not known" if model == "odd" else f"has {count} numbers"):
                camera()


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in ("width", "height")
                                             for value in (0, -1, 32768, 10**12, True, 1.5)])
def test_sizes(name, value):
    with pytest.raises(GeometryError, match=f"image_{name} must be"):
        dataclasses.replace(LEFT, **{name: value})


def test_shapes():
    for name in ("camera_matrix", "rectification", "projection"):
        with pytest.raises(GeometryError, match="must have"):
            dataclasses.replace(LEFT, **{name: getattr(LEFT, name).reshape(-1)})
    with pytest.raises(GeometryError, match="one row"):
        dataclasses.replace(LEFT, distortion=np.zeros((1, 5)))
    with pytest.raises(GeometryError, match="nan"):
        dataclasses.replace(LEFT, distortion=np.array([0, np.nan, 0, 0]))
    with pytest.raises(GeometryError, match="'none'"):
        dataclasses.replace(LEFT, distortion_model="none", distortion=np.array([0.1, 0, 0, 0]))


# Pairs.

@pytest.mark.parametrize("number", range(20))
def test_pairs_of_devices(number):
    """Pixels that are not square, a left camera that is not the origin, zeros with rounding errors."""
    rng         = generator(141, number)
    fx, fy      = rng.uniform(100, 200), rng.uniform(100, 200)
    base, tx    = rng.uniform(0.01, 2), rng.choice([0, -1e-17, 1e-17, *rng.uniform(-2, 2, 3)])
    ty, tz      = rng.uniform(-0.1, 0.1), rng.uniform(-0.01, 0.01)
    k           = np.array([[fx, 0, 70], [0, fy, 60], [0, 0, 1]])
    k_right     = k + np.array([[0, 0, rng.uniform(-5, 5)], [0, 0, 0], [0, 0, 0]])
    aside       = base*rng.uniform(-0.04, 0.04, 2)
    left        = dataclasses.replace(LEFT, projection=np.column_stack([k, k @ [tx, ty, tz]]))
    right       = dataclasses.replace(RIGHT, projection=np.column_stack([k_right, k_right @ [tx - base, ty + aside[0],
                                                                                             tz + aside[1]]]))
    geometry    = pair_geometry(left, right)
    assert (geometry.focal_px, geometry.focal_y_px) == (fx, fy)
    assert geometry.baseline_m == pytest.approx(base)
    again = pair_geometry(*ideal_cameras(geometry))
    assert dataclasses.astuple(again) == pytest.approx(dataclasses.astuple(geometry))
    # A point is where the projections see it.
    point  = np.array([0.3, -0.2, rng.uniform(1, 5)])
    ours   = (*point[:2]*(fx, fy)/point[2] + (70, 60), fx*base/point[2] + geometry.zero_px)
    cloud  = cv2.perspectiveTransform(np.array([[ours]]), geometry.q()).reshape(3)
    assert cloud == pytest.approx(point)
    column, row = int(ours[0]), int(ours[1])
    disparity   = np.full((120, 160), ours[2], np.float32)
    if 0 <= column < 160 and 0 <= row < 120:
        assert geometry.points_m(disparity)[row, column] == pytest.approx(
            [(column - 70)*point[2]/fx, (row - 60)*point[2]/fy, point[2]], rel=1e-4)
    with pytest.raises(GeometryError, match="swapped"):
        pair_geometry(right, left)


@pytest.mark.parametrize(("place", "good", "bad", "text"), [
    ((0, 0), (140.01, 139.99), (139.9, 140.1, 150.0), "focal length is 140 in"),
    ((1, 1), (140.01, 139.99), (139.9, 140.1, 150.0), "focal length is 140 in"),
    ((1, 2), (59.45, 59.55), (59.3, 59.7, 30.0), "row of the principal point is 59.5 in"),
    ((0, 2), (70.0, 90.0), (), ""),
    ((0, 3), (-1e-3, -8.4, -1000.0), (0.0, -1e-17, 1e-17, 8.4), "no baseline"),
    ((1, 3), (0.4, -0.4), (0.5, -0.5, -8.4), "one camera is below"),
    ((2, 3), (0.0029, -0.0029), (0.0031, -0.0031), "one camera is ahead of"),
])
def test_pairs_at_the_limits(place, good, bad, text):
    for value in good:
        pair_geometry(LEFT, changed(RIGHT, "projection", place, value))
    for value in bad:
        with pytest.raises(GeometryError, match=text):
            pair_geometry(LEFT, changed(RIGHT, "projection", place, value))


# Rectification.

@pytest.mark.parametrize(("coefficients", "model"), [
    ([-5, 0, 0, 0], "plumb_bob"), ([-2, 0, 0, 0, 0], "plumb_bob"), ([3, -30, 0, 0, 0], "plumb_bob"),
    ([-3, 3, 0, 0, 0], "plumb_bob"), ([0, 0, 0, 0, -100], "plumb_bob"),
    ([0, 0, 0, 0, 0, 8, 0, 0], "rational_polynomial"), ([-3, 0, 0, 0], "equidistant"),
])
def test_lenses_that_fold_the_image(coefficients, model):
    for index, side in enumerate(("left", "right")):
        pair        = [LEFT, RIGHT]
        pair[index] = dataclasses.replace(pair[index], distortion_model=model, distortion=np.array(coefficients, float))
        with pytest.raises(GeometryError, match=f"the {side} camera, .* fold the image|nothing remains of the {side}"):
            Rectifier(*pair)


@pytest.mark.parametrize(("coefficients", "model"), [
    ([-0.4, 0.2, 0.001, -0.001, 0], "plumb_bob"), ([0.2, 0, 0, 0], "plumb_bob"), ([-0.3, 0.1, 0, 0], "plumb_bob"),
    ([-0.05, 0.01, 0, 0], "equidistant"), ([20, 8, 0, 0, 0.4, 20.4, 15, 2.5], "rational_polynomial"),
])
def test_lenses_of_devices(coefficients, model):
    camera = dataclasses.replace(LEFT, distortion_model=model, distortion=np.array(coefficients, float))
    Rectifier(camera, RIGHT)


def test_a_corner_that_folds_is_black():
    """The polynomial of this lens turns back before the rectified image's corners: they show nothing twice."""
    camera    = dataclasses.replace(LEFT, distortion=np.array([-1.0, 0, 0, 0]))
    rectifier = Rectifier(camera, RIGHT)
    moved     = rectifier.rectify(np.full((120, 160), 200, np.uint8), np.full((120, 160), 200, np.uint8))[0]
    assert moved[60, 80] == 200 and (moved[0, 0], moved[-1, 0], moved[0, -1], moved[-1, -1]) == (0, 0, 0, 0)


@pytest.mark.parametrize("change", [
    {"rectification": cv2.Rodrigues(np.array([0, np.pi, 0]))[0]},
    {"rectification": cv2.Rodrigues(np.array([0, 1.5, 0]))[0]},
    {"camera_matrix": np.array([[140, 0, 1000], [0, 140, 59.5], [0, 0, 1]])},
    {"projection": np.array([[140*12, 0, 79.5, 0], [0, 140*12, 59.5, 0], [0, 0, 1, 0]])},
    {"projection": np.array([[140, 0, -1000, 0], [0, 140, 59.5, 0], [0, 0, 1, 0]])},
])
def test_nothing_remains(change):
    left        = dataclasses.replace(LEFT, **change)
    shift       = np.zeros((3, 4))
    shift[0, 3] = -0.06*left.projection[0, 0]
    right       = dataclasses.replace(RIGHT, projection=left.projection + shift)
    with pytest.raises(GeometryError, match="nothing remains of the left image"):
        Rectifier(left, right)


# calib.txt.

CALIB = {"cam0": "[140 0 79.5; 0 140 59.5; 0 0 1]", "cam1": "[140 0 81.25; 0 140 59.5; 0 0 1]", "doffs": "1.75",
         "baseline": "60", "width": "160", "height": "120", "ndisp": "32"}


def calib(**values):
    return parse_calib("".join(f"{name}={value}\n" for name, value in {**CALIB, **values}.items()).encode())


def test_a_calib_txt_and_what_it_may_lack():
    read = calib()
    assert calib(doffs="1.751", ndisp="32.0", width=" 160 ") == read
    assert read.ndisp == 32 and read.geometry.zero_px == -1.75 and read.geometry.baseline_m == pytest.approx(0.06)
    text = "".join(f"{name}={value}\n" for name, value in CALIB.items() if name not in ("doffs", "ndisp"))
    assert parse_calib(text.encode()).geometry == read.geometry and parse_calib(text.encode()).ndisp is None
    assert calib(doffs="1.84") == calib(doffs="1.66") == read
    oblong = calib(cam0="[140 0 79.5; 0 139 59.5; 0 0 1]", cam1="[140 0 81.25; 0 139 59.5; 0 0 1]").geometry
    assert (oblong.focal_px, oblong.focal_y_px) == (140, 139)


@pytest.mark.parametrize(("name", "value", "text"), [
    ("cam1", "[150 0 81.25; 0 140 59.5; 0 0 1]", "140 in cam0.*150 in cam1"),
    ("cam1", "[140 0 81.25; 0 141 59.5; 0 0 1]", "140 in cam0.*141 in cam1"),
    ("cam1", "[140 0 81.25; 0 140 61.5; 0 0 1]", "59.5 in cam0.*61.5 in cam1"),
    ("cam1", "[140 0 81.25; 0 140 59.5; 0 0 2]", r"cam1\[2\]\[2\] is 2"),
    ("cam0", "[0 0 79.5; 0 140 59.5; 0 0 1]", r"cam0\[0\]\[0\] is 0"),
    ("cam0", "[140 0 79.5; 0 140 59.5]", "'cam0=' with 9 numbers"),
    ("cam0", "[nan 0 79.5; 0 140 59.5; 0 0 1]", "not finite"),
    ("doffs", "1.86", "1.75 columns apart"), ("doffs", "0", "1.75 columns apart"), ("doffs", "-1.75", "columns apart"),
    ("doffs", "nan", "not finite"),
    *(("ndisp", value, "ndisp=") for value in ("inf", "-inf", "nan", "0", "-1", "32.5", "1e9", "many", "", "1_0")),
    *((name, value, name) for name in ("width", "height") for value in ("inf", "nan", "0", "-1", "32768", "160.5", "")),
    *(("baseline", value, "baseline") for value in ("inf", "nan", "0", "-60", "1e-5", "")),
])
def test_calibs_that_cannot_be(name, value, text):
    with pytest.raises(GeometryError, match=text) as error:
        calib(**{name: value})
    assert "\n" not in str(error.value)


def test_a_calib_txt_with_two_values():
    text = "".join(f"{name}={value}\n" for name, value in CALIB.items())
    assert parse_calib((text + "ndisp=32\n").encode()) == calib()
    with pytest.raises(GeometryError, match="two different values of 'ndisp'"):
        parse_calib((text + "ndisp=33\n").encode())


# Files.

def test_both_files_or_none(tmp_path):
    write_calibration(tmp_path, (LEFT, RIGHT))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["left.yaml", "right.yaml"]
    assert dataclasses.astuple(read_calibration(tmp_path).geometry) == pytest.approx(dataclasses.astuple(GEOMETRY))
    (tmp_path / "bad" / "right.yaml").mkdir(parents=True)
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "bad"):
        with pytest.raises(ImageError, match="cannot be written"):
            write_calibration(folder, (LEFT, RIGHT))
    assert not (tmp_path / "bad" / "right.yaml.new").exists()


def test_the_file_is_named(tmp_path):
    write_camera_info(tmp_path / "left.yaml", LEFT)
    text = (tmp_path / "left.yaml").read_text()
    (tmp_path / "left.yaml").write_text(text.replace("plumb_bob", "odd"))
    with pytest.raises(GeometryError, match=r"left\.yaml: the distortion model 'odd' is not known"):
        read_camera_info(tmp_path / "left.yaml")
