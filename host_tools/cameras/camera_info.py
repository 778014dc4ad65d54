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
from .check import check_distortion, check_finite, check_matrix, check_rotation, check_size, rectified_geometry
from .numbers import parse_number, quote
from .plain_yaml import parse_first

#: The matrices of a camera_info by their names in files of camera_calibration: the name in a message, the shape. The
#: number of distortion coefficients depends on the model.
_MATRICES: dict[str, tuple[str, tuple[int, ...] | None]] = {
    "camera_matrix":           ("k", (3, 3)),
    "distortion_coefficients": ("d", None),
    "rectification_matrix":    ("r", (3, 3)),
    "projection_matrix":       ("p", (3, 4)),
}


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
        P, float64, 3 x 4: of the rectified image, in pixels. P[0, 3] of the right camera is that of the left one minus
        the focal length times the baseline in metres; of the left one it is 0, except with more than two cameras.

    Raises
    ------
    GeometryError
        A number cannot be that of a camera: see `check`.
    """

    name:             str
    width:            int
    height:           int
    camera_matrix:    NDArray[np.float64]
    distortion_model: str
    distortion:       NDArray[np.float64]
    rectification:    NDArray[np.float64]
    projection:       NDArray[np.float64]

    def __post_init__(self) -> None:
        check_size("image_width", self.width)
        check_size("image_height", self.height)
        for name, (_, shape) in _MATRICES.items():
            if shape is not None:
                check_finite(name, getattr(self, _FIELDS[name]), shape)
        check_matrix("camera_matrix", self.camera_matrix, self.width, self.height)
        check_distortion(self.distortion_model, self.distortion)
        check_rotation("rectification_matrix", self.rectification)
        check_matrix("projection_matrix", self.projection, self.width, self.height)


#: Members of CameraInfo by the names of the matrices.
_FIELDS = {
    "camera_matrix":           "camera_matrix",
    "distortion_coefficients": "distortion",
    "rectification_matrix":    "rectification",
    "projection_matrix":       "projection",
}


def read_camera_info(path: Path) -> CameraInfo:
    """Read a camera from a YAML file of ROS: of camera_calibration, or the first message of `ros2 topic echo`.

    Raises
    ------
    ImageError
        The file cannot be read.
    GeometryError
        It is not a camera_info, or a value is missing or invalid.
    """
    try:
        return parse_camera_info(read_file(path), path.stem)
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None


def parse_camera_info(data: bytes, name: str) -> CameraInfo:
    """Return the camera in a YAML file's bytes; raise GeometryError as `read_camera_info`, without a file's name.

    `name` is that of the camera if the file has none.
    """
    content = parse_first(data)
    if "image_width" not in content and "height" in content:
        content = _message(content)
    sizes = [_size(content, side) for side in ("image_width", "image_height")]
    model = content.get("distortion_model", "plumb_bob")
    title = content.get("camera_name")
    if not isinstance(model, str):
        raise GeometryError(f"distortion_model must be a name, not {quote(model)}")
    return CameraInfo(
        name             = title if isinstance(title, str) else name,
        width            = sizes[0],
        height           = sizes[1],
        distortion_model = model,
        **{_FIELDS[matrix]: _matrix(content, matrix, shape) for matrix, (_, shape) in _MATRICES.items()},
    )


def _message(content: dict[Any, Any]) -> dict[Any, Any]:
    """Return a sensor_msgs/CameraInfo, as `ros2 topic echo` and `rostopic echo` print it, in the form of a file."""
    roi    = content.get("roi")
    region = roi if isinstance(roi, dict) else {}
    whole: list[tuple[str, Any, Any]]
    whole  = [(f"binning_{axis}", content.get(f"binning_{axis}"), "1") for axis in "xy"]
    whole += [(f"roi {name}", region.get(name), content.get(name)) for name in ("width", "height")]
    whole += [(f"roi {name}", region.get(name), "0") for name in ("x_offset", "y_offset")]
    for name, value, valid in whole:
        if value not in (None, "0", valid):
            raise GeometryError(f"{name} is {quote(value)}: only cameras that send whole images in full resolution are "
                                "supported")
    # ROS 1 has the names in capitals.
    values = {name: content.get(short, content.get(short.upper())) for name, (short, _) in _MATRICES.items()}
    return {
        **{name: {"data": value} for name, value in values.items()},
        "image_width":      content.get("width"),
        "image_height":     content.get("height"),
        "distortion_model": content.get("distortion_model", "plumb_bob"),
    }


def _size(content: dict[Any, Any], name: str) -> int:
    value = content.get(name)
    try:
        number = parse_number(value)
    except ValueError:
        number = np.nan
    if not np.isfinite(number) or number != int(number):
        raise GeometryError(f"{name} must be a number of pixels, not {quote(value)}")
    return int(number)


def _matrix(content: dict[Any, Any], name: str, shape: tuple[int, ...] | None) -> NDArray[np.float64]:
    """Return the matrix `name`, of `shape`, or a vector of any length if that is None; raise GeometryError."""
    entry = content.get(name)
    data  = entry.get("data") if isinstance(entry, dict) else None
    count = int(np.prod(shape)) if shape else None
    try:
        numbers = [parse_number(number) for number in data] if isinstance(data, list) else [np.nan]
    except ValueError:
        numbers = [np.nan]
    if len(numbers) != (len(numbers) if count is None else count) or not np.isfinite(numbers).all():
        wanted = "numbers" if count is None else f"{count} numbers"
        raise GeometryError(f"{name} must have {wanted} as its data, all finite, as camera_calibration writes it")
    return np.array(numbers, np.float64).reshape(shape or -1)


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
    return rectified_geometry(left.width, left.height, left.projection, right.projection,
                              ("the left camera's projection_matrix", "the right camera's projection_matrix"))


def ideal_cameras(geometry: StereoGeometry) -> tuple[CameraInfo, CameraInfo]:
    """Return left and right camera of images that are rectified already: no distortion, no rotation."""
    def camera(name: str, cx_px: float, shift: float) -> CameraInfo:
        projection = np.array([[geometry.focal_px, 0, cx_px, shift], [0, geometry.focal_y_px, geometry.cy_px, 0],
                               [0, 0, 1, 0]], np.float64)
        return CameraInfo(name, geometry.width, geometry.height, projection[:, :3].copy(), "plumb_bob", np.zeros(5),
                          np.eye(3), projection)

    return (camera("left", geometry.cx_left_px, 0.0),
            camera("right", geometry.cx_right_px, -geometry.focal_px*geometry.baseline_m))
