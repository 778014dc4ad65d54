#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Geometry of a rectified pair, against OpenCV."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import GeometryError
from litestereo.host_tools.core.geometry import StereoGeometry

GEOMETRY = StereoGeometry(width=64, height=48, focal_px=500.0, baseline_m=0.12, cx_left_px=31.5, cy_px=23.5,
                          cx_right_px=28.25)


def disparities() -> np.ndarray:
    return np.random.default_rng(1).uniform(3.5, 60, (48, 64)).astype(np.float32)


def test_points_are_those_of_opencv():
    disparity = disparities()
    np.testing.assert_allclose(GEOMETRY.points_m(disparity), cv2.reprojectImageTo3D(disparity, GEOMETRY.q()), rtol=1e-4)
    np.testing.assert_array_equal(GEOMETRY.points_m(disparity)[:, :, 2], GEOMETRY.depth_m(disparity))


def test_q_is_that_of_opencv():
    k     = np.array([[500, 0, 31.5], [0, 500, 23.5], [0, 0, 1.0]])
    apart = np.array([[-0.12], [0], [0]])
    _, _, p, right_p, q, *_ = cv2.stereoRectify(k, np.zeros(5), k, np.zeros(5), (64, 48), np.eye(3), apart,
                                                flags=0, alpha=0)
    ours  = StereoGeometry(64, 48, p[0, 0], 0.12, p[0, 2], p[1, 2], right_p[0, 2])
    np.testing.assert_allclose(ours.q(), q, atol=1e-9)


def test_pixels_that_are_not_square():
    """The second focal length is that of the columns: of points and of Q. Without it there is one."""
    oblong    = StereoGeometry(**{**GEOMETRY.__dict__, "focal_y_px": 400.0})
    disparity = disparities()
    points    = oblong.points_m(disparity)
    np.testing.assert_allclose(points, cv2.reprojectImageTo3D(disparity, oblong.q()), rtol=1e-4)
    np.testing.assert_allclose(points[:, :, 1], GEOMETRY.points_m(disparity)[:, :, 1]*1.25, rtol=1e-6)
    np.testing.assert_array_equal(points[:, :, [0, 2]], GEOMETRY.points_m(disparity)[:, :, [0, 2]])
    assert GEOMETRY.focal_y_px == GEOMETRY.focal_px


def test_nothing_is_not_near():
    disparity = np.array([[np.nan, GEOMETRY.zero_px, 0.0, GEOMETRY.zero_px + 10]], np.float32)
    depth     = GEOMETRY.depth_m(disparity)
    assert np.isnan(depth[0, 0])
    assert np.isinf(depth[0, 1:3]).all()
    assert depth[0, 3] == pytest.approx(6.0)
    assert np.isnan(GEOMETRY.points_m(disparity)[0, :3]).all()


@pytest.mark.parametrize(("name", "value"), [("focal_px", 0.0), ("focal_y_px", -1.0), ("focal_y_px", np.nan),
                                             ("baseline_m", -0.1), ("width", 0),
                                             ("cx_left_px", np.nan)])
def test_cameras_that_cannot_be(name, value):
    with pytest.raises(GeometryError, match=name):
        StereoGeometry(**{**GEOMETRY.__dict__, name: value})
