#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification without a calibration of one's own: lenses, borders, sizes."""

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.errors import GeometryError, ImageError
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.settings import MatcherSettings
from support.pairs import generator

IDEAL = StereoGeometry(width=100, height=60, focal_px=90.0, baseline_m=0.1, cx_left_px=50.0, cy_px=30.0,
                       cx_right_px=50.0)


def test_fisheye_cameras():
    cameras = [type(camera)(**{**vars(camera), "distortion_model": "equidistant", "distortion": np.zeros(4)})
               for camera in ideal_cameras(IDEAL)]
    image   = generator(123).integers(0, 256, (60, 100), np.uint8)
    moved   = Rectifier(*cameras).rectify(image, image)[0]
    # The image of an equidistant lens without coefficients: r = f*angle.
    radius  = 90*np.arctan(30/90)
    assert moved[30, 80] == pytest.approx(np.interp(50 + radius, np.arange(100), image[30]), abs=3)
    with pytest.raises(GeometryError, match="'odd' is not known"):
        Rectifier(*(type(camera)(**{**vars(camera), "distortion_model": "odd"}) for camera in cameras))


def test_maps_lose_what_matched_a_border():
    left, right = ideal_cameras(IDEAL)
    # The right camera's picture ends 10 columns before the rectified one does.
    matrix        = right.camera_matrix.copy()
    matrix[0, 2] += 10
    rectifier     = Rectifier(left, type(right)(**{**vars(right), "camera_matrix": matrix}))
    settings      = MatcherSettings(16, 5)
    cleaned       = rectifier.clean(np.full((60, 100), 4*16, np.int16), settings)
    # Columns 0 to 89 are picture on the right; a block reaches 2 further, and the disparity is 4.
    kept          = cleaned != settings.invalid
    assert kept[30].tolist() == [4 <= column <= 91 for column in range(100)]
    assert np.isnan(rectifier.depth_m(cleaned, settings)[30, 95])
    assert rectifier.depth_m(cleaned, settings)[30, 50] == pytest.approx(90*0.1/4)


def test_images_of_another_size():
    rectifier = Rectifier(*ideal_cameras(IDEAL))
    with pytest.raises(ImageError, match="right image is 99x60 pixels, the calibration is for 100x60"):
        rectifier.rectify(np.zeros((60, 100), np.uint8), np.zeros((60, 99), np.uint8))
