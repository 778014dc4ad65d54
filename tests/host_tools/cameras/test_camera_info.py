#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Camera files of ROS: what is written is read, and what is no rectified pair is refused."""

import dataclasses

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, pair_geometry, read_camera_info, write_camera_info
from litestereo.host_tools.core.errors import GeometryError, ImageError
from litestereo.host_tools.core.geometry import StereoGeometry

GEOMETRY = StereoGeometry(width=640, height=480, focal_px=500.5, baseline_m=0.12, cx_left_px=320.25, cy_px=239.5,
                          cx_right_px=318.0)

#: As camera_calibration writes it, with numbers that YAML 1.1 takes for texts.
EXAMPLE = """\
image_width: 640
image_height: 480
camera_name: rig/right
camera_matrix:
  rows: 3
  cols: 3
  data: [501., 0, 320.5, 0, 502., 240.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.125, 1e-5, -2e-4, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [500, 0, 310, -60, 0, 500, 240, 0, 0, 0, 1, 0]
"""


def test_a_file_of_ros(tmp_path):
    path = tmp_path / "right.yaml"
    path.write_text(EXAMPLE)
    camera = read_camera_info(path)
    assert (camera.name, camera.width, camera.height, camera.distortion_model) == ("rig/right", 640, 480, "plumb_bob")
    assert camera.distortion.tolist() == [-0.25, 0.125, 1e-5, -2e-4, 0]
    assert camera.camera_matrix[1].tolist() == [0, 502, 240.5]
    left       = camera.projection.copy()
    left[0, 2] = 320
    left[0, 3] = 0
    geometry   = pair_geometry(dataclasses.replace(camera, projection=left), camera)
    assert geometry == StereoGeometry(640, 480, 500.0, 0.12, 320.0, 240.0, 310.0)


def test_what_is_written_is_read(tmp_path):
    camera = dataclasses.replace(ideal_cameras(GEOMETRY)[1], distortion=np.array([1e-7, -1/3, 2.5e22, 0, 1]))
    write_camera_info(tmp_path / "new" / "right.yaml", camera)
    again = read_camera_info(tmp_path / "new" / "right.yaml")
    for field in dataclasses.fields(camera):
        np.testing.assert_array_equal(getattr(again, field.name), getattr(camera, field.name))


def test_ideal_cameras_have_the_geometry():
    geometry = pair_geometry(*ideal_cameras(GEOMETRY))
    assert dataclasses.astuple(geometry) == pytest.approx(dataclasses.astuple(GEOMETRY), rel=1e-12)


@pytest.mark.parametrize(("old", "new", "text"), [
    (EXAMPLE, "a: [1", "not a YAML file"),
    (EXAMPLE, "text", "not a camera_info"),
    ("image_width: 640", "image_width: wide", "image_width must be"),
    ("image_height: 480", "image_height: 0", "image_height must be"),
    (", 240.5, 0, 0, 1]", "]", "camera_matrix must have 9 numbers"),
    ("500, 0, 310", "fast, 0, 310", "projection_matrix must have 12 numbers"),
    ("500, 0, 310", ".nan, 0, 310", "projection_matrix must have 12 numbers"),
    ("rectification_matrix", "rotation", "rectification_matrix must have"),
    ("[-0.25, 0.125, 1e-5, -2e-4, 0]", "none", "distortion_coefficients must have numbers"),
])
def test_files_that_are_none(tmp_path, old, new, text):
    assert old in EXAMPLE
    (tmp_path / "right.yaml").write_text(EXAMPLE.replace(old, new))
    with pytest.raises(GeometryError, match=text) as error:
        read_camera_info(tmp_path / "right.yaml")
    assert "\n" not in str(error.value)


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(ImageError, match="no such file"):
        read_camera_info(tmp_path / "right.yaml")
    (tmp_path / "file").touch()
    with pytest.raises(ImageError, match="cannot be written"):
        write_camera_info(tmp_path / "file" / "right.yaml", ideal_cameras(GEOMETRY)[0])


def test_what_is_no_rectified_pair():
    left, right = ideal_cameras(GEOMETRY)
    with pytest.raises(GeometryError, match="swapped"):
        pair_geometry(right, left)
    with pytest.raises(GeometryError, match="one by one"):
        pair_geometry(left, left)
    with pytest.raises(GeometryError, match="one size"):
        pair_geometry(left, dataclasses.replace(right, width=641))
    for place in ((0, 0), (1, 1), (1, 2)):
        other         = right.projection.copy()
        other[place] += 1
        with pytest.raises(GeometryError, match="one rectified pair"):
            pair_geometry(left, dataclasses.replace(right, projection=other))
