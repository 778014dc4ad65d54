#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification: the images of a calibrated pair of cameras become images that the matcher can match."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError, ImageError
from ..core.geometry import StereoGeometry
from ..core.images import disparity_pixels
from ..core.settings import DISPARITY_SCALE, MatcherSettings
from .camera_info import CameraInfo, pair_geometry, read_camera_info

#: Names of the two files in a calibration's folder.
FILES = ("left.yaml", "right.yaml")

#: A position so little outside of an image is at its first or last pixel, except for rounding; in pixels.
_EDGE_PX = 0.01

#: An image of any depth: H x W, or H x W x 3.
Image = NDArray[Any]
Mask  = NDArray[np.bool_]


class Rectifier:
    """Rectifies the images of a calibrated pair of cameras.

    Parameters
    ----------
    left, right
        The cameras.

    Raises
    ------
    GeometryError
        They are not one rectified pair, or have an unknown distortion model.
    """

    def __init__(self, left: CameraInfo, right: CameraInfo) -> None:
        self.cameras  = (left, right)
        self.geometry = pair_geometry(left, right)
        self._maps    = [_maps(camera) for camera in self.cameras]
        # A rectified pixel outside of the camera's image is black, and black matches black: `clean` removes it.
        self._covered = [_covered(maps, camera) for maps, camera in zip(self._maps, self.cameras, strict=True)]

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


def _maps(camera: CameraInfo) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the column and the row in the image of each rectified pixel: float32, H x W, in pixels."""
    arguments = (camera.camera_matrix, camera.distortion, camera.rectification, camera.projection[:, :3],
                 (camera.width, camera.height), cv2.CV_32FC1)
    if camera.distortion_model == "equidistant":
        columns, rows = cv2.fisheye.initUndistortRectifyMap(*arguments)
    elif camera.distortion_model in ("plumb_bob", "rational_polynomial", "none", ""):
        columns, rows = cv2.initUndistortRectifyMap(*arguments)
    else:
        raise GeometryError(f"the distortion model '{camera.distortion_model}' is not known: plumb_bob, "
                            "rational_polynomial and equidistant are")
    return np.asarray(columns, np.float32), np.asarray(rows, np.float32)


def _covered(maps: tuple[NDArray[np.float32], NDArray[np.float32]], camera: CameraInfo) -> Mask:
    """Return which pixels of the rectified image the camera's image covers: bool, H x W."""
    columns, rows = maps
    return ((columns >= -_EDGE_PX) & (columns <= camera.width - 1 + _EDGE_PX)
            & (rows >= -_EDGE_PX) & (rows <= camera.height - 1 + _EDGE_PX))


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


def geometry_text(geometry: StereoGeometry) -> str:
    """Return the geometry as text."""
    return (f"{geometry.width}x{geometry.height} pixels, focal length {geometry.focal_px:.2f} pixels, baseline "
            f"{1000*geometry.baseline_m:.2f} mm")
