#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Where each rectified pixel is in a camera's image, from the numbers of the camera."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError
from .camera_info import CameraInfo

#: A position so little outside of an image is at its first or last pixel, except for rounding; in pixels.
_EDGE_PX = 0.01

#: Where a rectified pixel without a counterpart is in the image: far outside, so that it is black.
_NOWHERE_PX = -1e4

#: Largest share of the rectified pixels that a lens's distortion may show twice; so far outside it is extrapolated.
_MOST_FOLDED = 0.1

#: Least share of the rectified pixels that show something of the image, and of the image that they show.
_LEAST_COVERED = 0.1
_LEAST_SHOWN   = 0.01

Mask = NDArray[np.bool_]

#: Column and row in the camera's image of each rectified pixel: float32, H x W, in pixels.
FloatMaps = tuple[NDArray[np.float32], NDArray[np.float32]]


def float_maps(camera: CameraInfo, side: str) -> FloatMaps:
    """Return the column and the row in the image of each rectified pixel, outside of it if the pixel has none there.

    Raises
    ------
    GeometryError
        The distortion folds the image, or nothing of it remains; `side` names the camera.
    """
    arguments = (camera.camera_matrix, camera.distortion, camera.rectification, camera.projection[:, :3],
                 (camera.width, camera.height), cv2.CV_32FC1)
    find      = cv2.fisheye.initUndistortRectifyMap if camera.distortion_model == "equidistant" \
        else cv2.initUndistortRectifyMap
    columns, rows = (np.array(values, np.float32) for values in find(*arguments))
    ahead, centre = _ahead(camera)
    seen          = _unfolded(columns, rows, ahead, centre) if camera.distortion.any() else ahead
    folded        = np.mean(_inside((columns, rows), camera) & ahead & ~seen)
    if folded > _MOST_FOLDED:
        raise GeometryError(f"the distortion_coefficients of the {side} camera, "
                            f"{', '.join(f'{value:g}' for value in camera.distortion)}, fold the image: {folded:.0%} "
                            "of the rectified one would show parts of it a second time")
    columns[~seen], rows[~seen] = _NOWHERE_PX, _NOWHERE_PX
    _check_covered((columns, rows), camera, side)
    return columns, rows


def shows_all(maps: FloatMaps) -> bool:
    """Return whether the camera's lens shows something in each rectified pixel, inside of the image or not."""
    return bool((maps[0] != _NOWHERE_PX).all())


def _ahead(camera: CameraInfo) -> tuple[Mask, tuple[int, int]]:
    """Return which rectified pixels are rays ahead of the camera (bool, H x W), and the one nearest to its axis."""
    back          = np.linalg.inv(camera.projection[:, :3] @ camera.rectification)
    rows, columns = np.arange(camera.height)[:, None], np.arange(camera.width)
    x, y, z       = (back[axis, 0]*columns + (back[axis, 1]*rows + back[axis, 2]) for axis in range(3))
    ahead         = np.asarray(z > 0, np.bool_)
    tangent       = np.where(ahead, (x*x + y*y)/np.where(ahead, z*z, 1), np.inf)
    row, column   = np.unravel_index(np.argmin(tangent), tangent.shape)
    return ahead, (int(row), int(column))


def _unfolded(columns: NDArray[np.float32], rows: NDArray[np.float32], ahead: Mask, centre: tuple[int, int]) -> Mask:
    """Return the pixels around `centre` up to where the map turns back: bool, H x W.

    A polynomial of distortion holds up to the radius of its maximum. Beyond, it shows the image a second time.
    """
    if min(columns.shape) < 2:
        return ahead
    with np.errstate(over="ignore", invalid="ignore"):
        # Each is the derivative down, and across.
        column, row = np.gradient(columns), np.gradient(rows)
        area        = column[1]*row[0] - column[0]*row[1]
    _, regions = cv2.connectedComponents(((area > 0) & ahead).astype(np.uint8), connectivity=4)
    return np.asarray((regions == regions[centre]) & (regions[centre] > 0), np.bool_)


def _inside(maps: FloatMaps, camera: CameraInfo) -> Mask:
    """Return which pixels of the rectified image are mapped into the camera's image: bool, H x W."""
    columns, rows = maps
    return np.asarray((columns >= -_EDGE_PX) & (columns <= camera.width - 1 + _EDGE_PX)
                      & (rows >= -_EDGE_PX) & (rows <= camera.height - 1 + _EDGE_PX), np.bool_)


def _check_covered(maps: FloatMaps, camera: CameraInfo, side: str) -> None:
    """Raise GeometryError if the rectified image is black, or shows a few pixels of the image only."""
    covered = _inside(maps, camera)
    share   = float(np.mean(covered))
    shown   = (np.prod([np.ptp(values[covered]) + 1 for values in maps])/(camera.width*camera.height)
               if covered.any() else 0.0)
    if share < _LEAST_COVERED or shown < _LEAST_SHOWN:
        raise GeometryError(f"nothing remains of the {side} image: the rectified one is covered to {share:.0%} and "
                            f"shows {min(shown, 1):.0%} of it; camera_matrix, distortion_coefficients, "
                            "rectification_matrix and projection_matrix do not fit each other")
