#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification: the images of a calibrated pair of cameras become images that the matcher can match."""

from __future__ import annotations

import contextlib
import functools
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError, ImageError
from ..core.geometry import StereoGeometry
from ..core.images import disparity_pixels
from ..core.settings import DISPARITY_SCALE, MatcherSettings
from .camera_info import CameraInfo, pair_geometry, read_camera_info, write_camera_info
from .fixed_map import FixedMap, Image
from .float_maps import float_maps
from .pair_grids import FittedGrids, fit_pair

#: Names of the two files in a calibration's folder.
FILES = ("left.yaml", "right.yaml")


@dataclass(frozen=True, eq=False)
class PairMaps:
    """What a pair is rectified with.

    Parameters
    ----------
    maps
        Of the left and the right camera.
    grids
        The grids that the maps are made of, as a device makes them; None if each pixel has its own position.
    no_grids
        Why there are no grids; empty if there are.
    """

    maps:     tuple[FixedMap, FixedMap]
    grids:    FittedGrids | None
    no_grids: str = ""


class Rectifier:
    """Rectifies the images of a calibrated pair of cameras.

    The bits are those of a device with the same grids, and of every version of OpenCV. Cameras whose map no device can
    hold are rectified with a position for each pixel.

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
        self.cameras     = (left, right)
        self.geometry    = pair_geometry(left, right)
        self._float_maps = (float_maps(left, "left"), float_maps(right, "right"))

    @functools.cached_property
    def pair(self) -> PairMaps:
        """The maps of both cameras, and their grids."""
        try:
            grids = fit_pair(self._float_maps)
        except GeometryError as error:
            left, right = (FixedMap.of_pixels(maps) for maps in self._float_maps)
            return PairMaps((left, right), None, str(error))
        left, right = (FixedMap.of_grid(grid) for grid in grids.grids)
        return PairMaps((left, right), grids)

    def check_size(self, left: Image, right: Image) -> None:
        """Raise ImageError if images (H x W, or H x W x 3) have not the calibration's size."""
        size = (self.geometry.height, self.geometry.width)
        for side, image in (("left", left), ("right", right)):
            if image.shape[:2] != size:
                raise ImageError(f"the {side} image is {image.shape[1]}x{image.shape[0]} pixels, the calibration is "
                                 f"for {size[1]}x{size[0]}")

    def rectify(self, left: Image, right: Image) -> tuple[Image, Image]:
        """Rectify a pair of images (H x W, or H x W x 3); raise ImageError if they have not the calibration's size."""
        self.check_size(left, right)
        maps = self.pair.maps
        return maps[0].remap(left), maps[1].remap(right)

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
        # A rectified pixel outside of the camera's image is black, and black matches black.
        left, right = (cv2.erode(maps.covered.astype(np.uint8), block, borderValue=1) > 0 for maps in self.pair.maps)
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
