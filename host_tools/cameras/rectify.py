#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification: the images of a calibrated pair of cameras become images that the matcher can match."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError, ImageError
from ..core.geometry import StereoGeometry
from ..core.images import disparity_pixels
from ..core.settings import DISPARITY_SCALE, MatcherSettings
from .camera_info import CameraInfo, pair_geometry, read_camera_info, write_camera_info

#: Names of the two files in a calibration's folder.
FILES = ("left.yaml", "right.yaml")

#: A position so little outside of an image is at its first or last pixel, except for rounding; in pixels.
_EDGE_PX = 0.01

#: Where a rectified pixel without a counterpart is in the image: far outside, so that it is black.
_NOWHERE_PX = -1e4

#: Largest share of the rectified pixels that a lens's distortion may show twice; so far outside it is extrapolated.
_MOST_FOLDED = 0.1

#: Least share of the rectified pixels that show something of the image, and of the image that they show.
_LEAST_COVERED = 0.1
_LEAST_SHOWN   = 0.01

#: An image of any depth: H x W, or H x W x 3.
Image = NDArray[Any]
Mask  = NDArray[np.bool_]

#: Column and row in the camera's image of each rectified pixel: float32, H x W, in pixels.
Maps = tuple[NDArray[np.float32], NDArray[np.float32]]


class Rectifier:
    """Rectifies the images of a calibrated pair of cameras.

    Parameters
    ----------
    left, right
        The cameras.

    Raises
    ------
    GeometryError
        They are not one rectified pair, a lens's distortion folds the image, or nothing of an image remains.
    """

    def __init__(self, left: CameraInfo, right: CameraInfo) -> None:
        self.cameras  = (left, right)
        self.geometry = pair_geometry(left, right)
        self._maps    = [_maps(camera, side) for camera, side in zip(self.cameras, ("left", "right"), strict=True)]
        # A rectified pixel outside of the camera's image is black, and black matches black: `clean` removes it.
        self._covered = [_inside(maps, camera) for maps, camera in zip(self._maps, self.cameras, strict=True)]
        for side, camera, maps, covered in zip(("left", "right"), self.cameras, self._maps, self._covered, strict=True):
            _check_covered(side, camera, maps, covered)

    def rectify(self, left: Image, right: Image) -> tuple[Image, Image]:
        """Rectify a pair of images (H x W, or H x W x 3); raise ImageError if they have not the calibration's size."""
        size = (self.geometry.height, self.geometry.width)
        for side, image in (("left", left), ("right", right)):
            if image.shape[:2] != size:
                raise ImageError(f"the {side} image is {image.shape[1]}x{image.shape[0]} pixels, the calibration is "
                                 f"for {size[1]}x{size[0]}")
        moved = [cv2.remap(image, *maps, cv2.INTER_LINEAR)
                 for image, maps in zip((left, right), self._maps, strict=True)]
        return moved[0], moved[1]

    def clean(self, disparity: NDArray[np.int16], settings: MatcherSettings) -> NDArray[np.int16]:
        """Return a copy of a map without the disparities whose blocks reach outside of the cameras' images.

        Parameters
        ----------
        disparity
            Map of a rectified pair: int16, H x W, sixteenths of a pixel.
        settings
            The map was matched with these. A pixel keeps its disparity if its block lies in the left image, and the
            block at its disparity in the right one.
        """
        block       = np.ones((settings.block_size, settings.block_size), np.uint8)
        left, right = (cv2.erode(covered.astype(np.uint8), block, borderValue=1) > 0 for covered in self._covered)
        rows, columns = np.indices(disparity.shape)
        there   = columns - np.rint(disparity/DISPARITY_SCALE).astype(np.int64)
        inside  = (there >= 0) & (there < disparity.shape[1])
        kept    = left & inside & right[rows, np.clip(there, 0, disparity.shape[1] - 1)]
        return np.where(kept, disparity, np.int16(settings.invalid)).astype(np.int16)

    def depth_m(self, disparity: NDArray[np.int16], settings: MatcherSettings) -> NDArray[np.float32]:
        """Return the depth of a map (int16, H x W, sixteenths): float32, H x W, in metres, nan where there is none."""
        depth                  = self.geometry.depth_m(disparity_pixels(disparity, settings.invalid))
        depth[np.isinf(depth)] = np.nan
        return depth


def _maps(camera: CameraInfo, side: str) -> Maps:
    """Return the column and the row in the image of each rectified pixel, outside of it if the pixel has none there.

    Raise GeometryError if the distortion folds the image.
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
    return columns, rows


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


def _inside(maps: Maps, camera: CameraInfo) -> Mask:
    """Return which pixels of the rectified image are mapped into the camera's image: bool, H x W."""
    columns, rows = maps
    return np.asarray((columns >= -_EDGE_PX) & (columns <= camera.width - 1 + _EDGE_PX)
                      & (rows >= -_EDGE_PX) & (rows <= camera.height - 1 + _EDGE_PX), np.bool_)


def _check_covered(side: str, camera: CameraInfo, maps: Maps, covered: Mask) -> None:
    """Raise GeometryError if the rectified image is black, or shows a few pixels of the image only."""
    share = float(np.mean(covered))
    shown = (np.prod([np.ptp(values[covered]) + 1 for values in maps])/(camera.width*camera.height)
             if covered.any() else 0.0)
    if share < _LEAST_COVERED or shown < _LEAST_SHOWN:
        raise GeometryError(f"nothing remains of the {side} image: the rectified one is covered to {share:.0%} and "
                            f"shows {min(shown, 1):.0%} of it; camera_matrix, distortion_coefficients, "
                            "rectification_matrix and projection_matrix do not fit each other")


def read_calibration(folder: Path) -> Rectifier:
    """Build the rectifier for the cameras in `left.yaml` and `right.yaml` of a folder.

    Raises
    ------
    ImageError, GeometryError
        A file is missing or is not a camera_info of ROS, or the two are not one pair.
    """
    if not folder.is_dir():
        raise GeometryError(f"{folder}: there is no such folder, `litestereo calibrate` makes one")
    left, right = (read_camera_info(folder / name) for name in FILES)
    return Rectifier(left, right)


def write_calibration(folder: Path, cameras: tuple[CameraInfo, CameraInfo]) -> None:
    """Write `left.yaml` and `right.yaml` of a pair, both or none; create the folder if needed.

    Raises
    ------
    ImageError
        One of them cannot be written. Files that were there before remain.
    """
    new = [folder / f"{name}.new" for name in FILES]
    try:
        for path, camera in zip(new, cameras, strict=True):
            write_camera_info(path, camera)
        for path, name in zip(new, FILES, strict=True):
            try:
                path.replace(folder / name)
            except OSError as error:
                raise ImageError(f"{folder / name}: cannot be written: {error.strerror or error}") from None
    finally:
        for path in new:
            # A folder that is none has no such file either.
            with contextlib.suppress(OSError):
                path.unlink()


def geometry_text(geometry: StereoGeometry) -> str:
    """Return the geometry as text."""
    return (f"{geometry.width}x{geometry.height} pixels, focal length {geometry.focal_px:.2f} pixels, baseline "
            f"{1000*geometry.baseline_m:.2f} mm")
