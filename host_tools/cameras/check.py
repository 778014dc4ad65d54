#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the numbers of a camera and of a rectified pair must be: one rule for files and for Python's callers.

Each check raises GeometryError. Its message names the number and says why, but not the file. Each has a tolerance, for
files are rounded.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError
from ..core.geometry import StereoGeometry

#: Largest width and height in pixels: OpenCV's remap has 16-bit positions.
MAX_SIZE = 32767

#: Numbers of distortion coefficients by ROS's names of the models. An empty list is a lens without distortion.
COEFFICIENTS = {
    "plumb_bob":           (4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant":         (4,),
    "none":                (4, 5, 8, 12, 14),
    "":                    (4, 5, 8, 12, 14),
}

#: Names of the models for an error.
_MODELS = "plumb_bob, rational_polynomial and equidistant"

#: Least and largest focal length, relative to the larger side of the image: 175 and 0.06 degrees of view.
_LEAST_FOCAL = 0.02
_MOST_FOCAL  = 1000.0

#: Largest ratio of the two focal lengths, that is of the sides of a pixel.
_MOST_ASPECT = 2.0

#: Largest distance of the principal point from the image's centre, relative to its larger side.
_MOST_OFFSET = 10.0

#: Tolerance of what must be 0 or 1 in a matrix; the elements of its first two rows are relative to the focal length.
_MATRIX_TOLERANCE = 1e-3

#: Largest element of R*R^T - 1: R may be rounded to three decimals.
_ROTATION_TOLERANCE = 5e-3

#: Relative difference of two focal lengths, and difference of two rows in pixels, that are one but for rounding.
_FOCAL_TOLERANCE  = 1e-4
_ROW_TOLERANCE_PX = 0.1

#: Least baseline in metres; a smaller one is a 0 with rounding errors.
LEAST_BASELINE_M = 1e-6

#: Largest distance of the cameras down and ahead, relative to the baseline: KITTI's have 0.6 %.
_MOST_ASIDE = 0.05


def check_size(name: str, value: Any) -> None:
    """Check a width or height in pixels: a whole number from 1 to 32767."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 1 <= value <= MAX_SIZE:
        raise GeometryError(f"{name} must be a number of pixels from 1 to {MAX_SIZE}, not {value}")


def check_finite(name: str, values: NDArray[np.float64], shape: tuple[int, ...]) -> None:
    """Check that an array has a shape and that all of its numbers are finite."""
    if values.shape != shape:
        raise GeometryError(f"{name} must have {' x '.join(map(str, shape))} numbers, not "
                            f"{' x '.join(map(str, values.shape))}")
    bad = values[~np.isfinite(values)]
    if len(bad):
        raise GeometryError(f"{name} has {bad[0]:g} among its numbers")


def check_matrix(name: str, matrix: NDArray[np.float64], width: int, height: int) -> None:
    """Check a camera matrix, or the left 3 x 3 of a projection matrix: fx, 0, cx; 0, fy, cy; 0, 0, 1, in pixels."""
    def require(valid: bool, row: int, column: int, why: str) -> None:
        if not valid:
            raise GeometryError(f"{name}[{row}][{column}] is {matrix[row, column]:g}, {why}")

    size  = max(width, height)
    focal = matrix[0, 0]
    require(focal != 0, 0, 0, "the focal length: 0 means that the camera is not calibrated (REP 104)")
    for axis in (0, 1):
        require(_LEAST_FOCAL*size <= matrix[axis, axis] <= _MOST_FOCAL*size, axis, axis,
                f"no focal length in pixels for an image of {width}x{height}")
    require(1/_MOST_ASPECT <= matrix[1, 1]/focal <= _MOST_ASPECT, 1, 1, f"but the other focal length is {focal:g}")
    for row, column in ((0, 1), (1, 0)):
        require(abs(matrix[row, column]) <= _MATRIX_TOLERANCE*focal, row, column,
                "it must be 0: a skew is not supported")
    for column, value in enumerate((0, 0, 1)):
        require(abs(matrix[2, column] - value) <= _MATRIX_TOLERANCE, 2, column, f"it must be {value}")
    for row, side in ((0, width), (1, height)):
        require(abs(matrix[row, 2] - side/2) <= _MOST_OFFSET*size, row, 2,
                f"a principal point far outside of an image of {width}x{height}")


def check_rotation(name: str, matrix: NDArray[np.float64]) -> None:
    """Check that a matrix, float64, 3 x 3, is a rotation."""
    if not matrix.any():
        raise GeometryError(f"{name} is all 0 and no rotation: of a camera without one it has 1 0 0, 0 1 0, 0 0 1")
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.abs(matrix @ matrix.T - np.eye(3)).max()
    # Not above: nan after an overflow.
    if not error <= _ROTATION_TOLERANCE:
        raise GeometryError(f"{name} is no rotation: its rows are not of length 1 and at right angles, by {error:.2g}")
    if np.linalg.det(matrix) < 0:
        raise GeometryError(f"{name} is no rotation but a reflection: its determinant is -1")


def check_distortion(model: str, coefficients: NDArray[np.float64]) -> None:
    """Check the name of a distortion model, and that it has so many coefficients."""
    name = "distortion_coefficients"
    if model not in COEFFICIENTS:
        raise GeometryError(f"the distortion model {ascii(model[:40])} is not known: {_MODELS} are")
    if coefficients.ndim != 1:
        raise GeometryError(f"{name} must be one row of numbers, not of shape {coefficients.shape}")
    check_finite(name, coefficients, coefficients.shape)
    counts = COEFFICIENTS[model]
    if len(coefficients) not in (0, *counts):
        every = "; 4, 5, 8, 12 or 14 are known of all models" if model != "equidistant" else ""
        one   = " or ".join(map(str, counts))
        raise GeometryError(f"{name} has {len(coefficients)} numbers, the distortion model '{model}' has {one}{every}")
    if model == "none" and coefficients.any():
        raise GeometryError(f"{name} must all be 0 with the distortion model 'none'")


def rectified_geometry(width: int, height: int, left: NDArray[np.float64], right: NDArray[np.float64],
                       names: tuple[str, str]) -> StereoGeometry:
    """Return the geometry of a rectified pair, from two projection matrices that have passed `check_matrix`.

    Parameters
    ----------
    width, height
        Size of both images in pixels.
    left, right
        float64, 3 x 4, in pixels; the last columns in pixels times metres.
    names
        What errors call the two.
    """
    for row, column, what in ((0, 0, "focal length"), (1, 1, "focal length"), (1, 2, "row of the principal point")):
        one, other = left[row, column], right[row, column]
        tolerance  = _ROW_TOLERANCE_PX if column == 2 else _FOCAL_TOLERANCE*one
        if abs(one - other) > tolerance:
            raise GeometryError(f"the {what} is {one:.10g} in {names[0]}[{row}][{column}] and {other:.10g} in "
                                f"{names[1]}: these cameras are not calibrated as one rectified pair")
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.linalg.solve(left[:, :3], left[:, 3]) - np.linalg.solve(right[:, :3], right[:, 3])
    if not apart[0] >= LEAST_BASELINE_M:
        raise GeometryError(f"{names[1]}[0][3] of {right[0, 3]:g} has no baseline to the right of the left one with "
                            f"{left[0, 3]:g}: are left and right swapped, or calibrated one by one?")
    for axis, where in ((1, "below"), (2, "ahead of")):
        if not abs(apart[axis]) <= _MOST_ASIDE*apart[0]:
            raise GeometryError(f"{names[1]}[{axis}][3] of {right[axis, 3]:g} is not that of {names[0]}, "
                                f"{left[axis, 3]:g}: one camera is {where} the other, the pair is not rectified")
    return StereoGeometry(width, height, float(left[0, 0]), float(apart[0]), float(left[0, 2]), float(left[1, 2]),
                          float(right[0, 2]), float(left[1, 1]))
