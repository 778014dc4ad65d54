#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Tells the two kinds of camera files apart: calibrated cameras, and those of images that are rectified already."""

from __future__ import annotations

from typing import Any

import numpy as np
import yaml

from ..core.outputs import Kind


def _is_camera(data: bytes, rectified: bool) -> bool:
    try:
        content: Any  = yaml.safe_load(data)
        distortion    = np.array(content["distortion_coefficients"]["data"], np.float64)
        rectification = np.array(content["rectification_matrix"]["data"], np.float64)
        complete      = "image_width" in content and "camera_matrix" in content
        return complete and rectified == (not distortion.any() and np.array_equal(rectification, np.eye(3).ravel()))
    except (yaml.YAMLError, RecursionError, UnicodeError, KeyError, TypeError, ValueError):
        return False


def _camera_kind(name: str, rectified: bool) -> Kind:
    return Kind(name, lambda head: _is_camera(head, rectified))


CALIBRATED_CAMERA = _camera_kind("calibrated camera", False)
RECTIFIED_CAMERA  = _camera_kind("camera of rectified images", True)
