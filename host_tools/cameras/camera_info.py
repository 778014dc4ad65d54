#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Camera files of ROS (`camera_info`, the YAML that camera_calibration writes), one for each camera of a pair."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from ..core.errors import GeometryError
from ..core.geometry import StereoGeometry
from ..core.images import read_file
from ..core.outputs import write_file

#: Relative difference of two numbers of a rectified pair that are one number but for rounding in their files.
_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class CameraInfo:
    """One camera of a rectified pair, as a ROS camera_info has it.

    Parameters
    ----------
    name
        Name of the camera.
    width, height
        Size of its images in pixels.
    camera_matrix
        K, float64, 3 x 3: of the image as the camera takes it, in pixels.
    distortion_model, distortion
        "plumb_bob", "rational_polynomial" or "equidistant", and its coefficients, float64, N.
    rectification
        R, float64, 3 x 3: rotates the camera's frame so that both cameras share one image plane.
    projection
        P, float64, 3 x 4: of the rectified image, in pixels. For the right camera, P[0, 3] is the focal length times
        the baseline in metres, negative.
    """

    name:             str
    width:            int
    height:           int
    camera_matrix:    NDArray[np.float64]
    distortion_model: str
    distortion:       NDArray[np.float64]
    rectification:    NDArray[np.float64]
    projection:       NDArray[np.float64]


def read_camera_info(path: Path) -> CameraInfo:
    """Read a camera from a YAML file of ROS.

    Raises
    ------
    ImageError
        The file cannot be read.
    GeometryError
        It is not a camera_info, or a value is missing or invalid.
    """
    try:
        content = yaml.safe_load(read_file(path))
    except (yaml.YAMLError, UnicodeDecodeError):
        raise GeometryError(f"{path}: is not a YAML file, a camera_info of ROS is needed") from None
    if not isinstance(content, dict):
        raise GeometryError(f"{path}: is not a camera_info of ROS: it has no image_width")
    sizes = [_size(content, name, path) for name in ("image_width", "image_height")]
    return CameraInfo(
        name             = str(content.get("camera_name", path.stem)),
        width            = sizes[0],
        height           = sizes[1],
        camera_matrix    = _matrix(content, "camera_matrix", (3, 3), path),
        distortion_model = str(content.get("distortion_model", "plumb_bob")),
        distortion       = _matrix(content, "distortion_coefficients", None, path),
        rectification    = _matrix(content, "rectification_matrix", (3, 3), path),
        projection       = _matrix(content, "projection_matrix", (3, 4), path),
    )


def _size(content: dict[Any, Any], name: str, path: Path) -> int:
    value = content.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise GeometryError(f"{path}: {name} must be a number of pixels, not {value!r}")
    return value


def _matrix(content: dict[Any, Any], name: str, shape: tuple[int, int] | None, path: Path) -> NDArray[np.float64]:
    """Return the matrix `name`, of `shape`, or a vector of any length if that is None; raise GeometryError."""
    entry = content.get(name)
    data  = entry.get("data") if isinstance(entry, dict) else None
    data  = data if isinstance(data, list) else [None]
    count = len(data) if shape is None else shape[0]*shape[1]
    try:
        # YAML 1.1 parses a number like 1e-5 as a string; float() converts both.
        numbers = [float(number) for number in data]
    except (TypeError, ValueError):
        numbers = [np.nan]
    if len(numbers) != count or not np.isfinite(numbers).all():
        wanted = "numbers" if shape is None else f"{count} numbers"
        raise GeometryError(f"{path}: {name} must have {wanted} as its data, as camera_calibration writes it")
    return np.array(numbers, np.float64).reshape(shape or (count,))


def write_camera_info(path: Path, camera: CameraInfo) -> None:
    """Write a camera as ROS reads it, and create the folder if needed; raise ImageError if it cannot be written."""
    def entry(matrix: NDArray[np.float64]) -> dict[str, Any]:
        rows = 1 if matrix.ndim == 1 else matrix.shape[0]
        return {"rows": rows, "cols": matrix.size//rows, "data": [float(number) for number in matrix.flat]}

    content = {
        "image_width":             camera.width,
        "image_height":            camera.height,
        "camera_name":             camera.name,
        "camera_matrix":           entry(camera.camera_matrix),
        "distortion_model":        camera.distortion_model,
        "distortion_coefficients": entry(camera.distortion),
        "rectification_matrix":    entry(camera.rectification),
        "projection_matrix":       entry(camera.projection),
    }
    text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=1 << 20)
    write_file(path, text.encode())


def pair_geometry(left: CameraInfo, right: CameraInfo) -> StereoGeometry:
    """Return the geometry of a rectified pair, from the two projection matrices.

    Raises
    ------
    GeometryError
        The two are not of one rectified pair, or are swapped.
    """
    if (left.width, left.height) != (right.width, right.height):
        raise GeometryError(f"the left camera has {left.width}x{left.height} pixels, the right one "
                            f"{right.width}x{right.height}: both must be of one size")
    focal_px = left.projection[0, 0]
    alike    = [left.projection[1, 1], right.projection[0, 0], right.projection[1, 1]]
    row      = np.isclose(left.projection[1, 2], right.projection[1, 2], rtol=_TOLERANCE, atol=_TOLERANCE)
    if not row or not np.allclose(alike, focal_px, rtol=_TOLERANCE, atol=0):
        raise GeometryError("the projection matrices have different focal lengths or rows: these cameras are not "
                            "calibrated as one rectified pair")
    if left.projection[0, 3] != 0 or not right.projection[0, 3] < 0:
        raise GeometryError("the right camera's projection matrix has no baseline to the right of the left one: are "
                            "left and right swapped, or calibrated one by one?")
    return StereoGeometry(
        width       = left.width,
        height      = left.height,
        focal_px    = float(focal_px),
        baseline_m  = float(-right.projection[0, 3]/right.projection[0, 0]),
        cx_left_px  = float(left.projection[0, 2]),
        cy_px       = float(left.projection[1, 2]),
        cx_right_px = float(right.projection[0, 2]),
    )


def ideal_cameras(geometry: StereoGeometry) -> tuple[CameraInfo, CameraInfo]:
    """Return left and right camera of images that are rectified already: no distortion, no rotation."""
    def camera(name: str, cx_px: float, shift: float) -> CameraInfo:
        projection = np.array([[geometry.focal_px, 0, cx_px, shift], [0, geometry.focal_px, geometry.cy_px, 0],
                               [0, 0, 1, 0]], np.float64)
        return CameraInfo(name, geometry.width, geometry.height, projection[:, :3].copy(), "plumb_bob", np.zeros(5),
                          np.eye(3), projection)

    return (camera("left", geometry.cx_left_px, 0.0),
            camera("right", geometry.cx_right_px, -geometry.focal_px*geometry.baseline_m))
