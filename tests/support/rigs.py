#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Drawn pairs of cameras, as cheap rigs have them, and the maps that rectify them."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.cameras.camera_info import CameraInfo
from litestereo.host_tools.core.grid import ONE, Grid

from .limits import Draws, Range, Rng

#: Focal length in pixels at 640 columns, k1, k2, deviation of p1 and p2, k3, by the angle of view in degrees.
LENSES = {
    44: (800, -0.25, 0.15, 0.0010, 0.0),
    60: (560, -0.35, 0.16, 0.0012, -0.04),
    77: (400, -0.32, 0.13, 0.0012, -0.025),
    90: (320, -0.30, 0.10, 0.0015, -0.015),
}

BASELINE_M = 0.06

#: Images of both cameras.
Pair = tuple[NDArray[np.uint8], NDArray[np.uint8]]

#: Columns and rows of each camera: float32, H x W, in pixels.
FloatMaps = tuple[NDArray[np.float32], NDArray[np.float32]]


def _matrix(rng: np.random.Generator, focal: float, width: int, height: int) -> NDArray[np.float64]:
    """Return K of a camera whose centre is a little off."""
    shift = rng.normal(0, width/107, 2)
    focal = focal*(1 + rng.normal(0, 0.01))
    return np.array([[focal, 0, (width - 1)/2 + shift[0]], [0, focal, (height - 1)/2 + shift[1]], [0, 0, 1]])


def _rotation(rng: np.random.Generator, degrees: float) -> NDArray[np.float64]:
    """Return a rotation by an angle about a drawn axis."""
    axis = rng.normal(size=3)
    return np.asarray(cv2.Rodrigues(axis/np.linalg.norm(axis)*np.deg2rad(degrees))[0], np.float64)


def _coefficients(rng: np.random.Generator, view: int) -> NDArray[np.float64]:
    """Return the distortion of a lens: k1, k2, p1, p2, k3."""
    _, k1, k2, tangential, k3 = LENSES[view]
    return np.array([*np.array([k1, k2])*(1 + rng.normal(0, 0.05, 2)), *rng.normal(0, tangential, 2), k3])


def lens_maps(rng: np.random.Generator, view: int, degrees: float, width: int, height: int) -> list[FloatMaps]:
    """Return the maps of two cameras with lenses of `view` degrees, misaligned by `degrees`; all pixels are covered.

    Where the polynomial of a drawn lens turns back inside of the image, the pair is drawn again.
    """
    own = np.meshgrid(np.arange(width), np.arange(height))
    while True:
        maps = _lens_maps(rng, view, degrees, width, height)
        if max(abs(values - place).max() for one in maps for values, place in zip(one, own, strict=True)) < 0.24*width:
            return maps


#: K, distortion, R and P of a camera.
Numbers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _lens_numbers(rng: np.random.Generator, view: int, degrees: float, width: int, height: int) -> list[Numbers]:
    """Return two cameras with lenses of `view` degrees, misaligned by `degrees`."""
    size    = (width, height)
    focal   = LENSES[view][0]*width/640
    cameras = [(_matrix(rng, focal, width, height), _coefficients(rng, view)) for _ in range(2)]
    off     = rng.normal(size=2)
    off    *= np.tan(np.deg2rad(degrees))*rng.uniform(0, 1)/np.linalg.norm(off)
    moved   = -BASELINE_M*np.array([[1], [off[0]], [off[1]]])
    found   = cv2.stereoRectify(*cameras[0], *cameras[1], size, _rotation(rng, degrees), moved,
                                flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
    return [(*camera, rotation, projection)
            for camera, rotation, projection in zip(cameras, found[:2], found[2:4], strict=True)]


def _lens_maps(rng: np.random.Generator, view: int, degrees: float, width: int, height: int) -> list[FloatMaps]:
    return [cv2.initUndistortRectifyMap(*camera, rotation, projection[:, :3], (width, height), cv2.CV_32FC1)
            for *camera, rotation, projection in _lens_numbers(rng, view, degrees, width, height)]


def lens_cameras(rng: np.random.Generator, view: int, degrees: float, width: int, height: int
                 ) -> tuple[CameraInfo, CameraInfo]:
    """Return two cameras with lenses of `view` degrees, misaligned by `degrees`; their maps may fold at the edges."""
    left, right = (CameraInfo(name, width, height, matrix, "plumb_bob", coefficients, rotation, projection)
                   for name, (matrix, coefficients, rotation, projection)
                   in zip(("left", "right"), _lens_numbers(rng, view, degrees, width, height), strict=True))
    return left, right


def fisheye_maps(rng: np.random.Generator, degrees: float, width: int, height: int) -> list[FloatMaps]:
    """Return the maps of two cameras with equidistant lenses of 110 degrees, of which the middle 75 are kept."""
    size = (width, height)
    view = np.array([[0.65*width, 0, (width - 1)/2], [0, 0.65*width, (height - 1)/2], [0, 0, 1]])
    return [cv2.fisheye.initUndistortRectifyMap(_matrix(rng, 0.52*width, width, height), rng.normal(0, 0.01, 4),
                                                _rotation(rng, degrees/2), view, size, cv2.CV_32FC1)
            for _ in range(2)]


def drawn_maps(rng: np.random.Generator, kind: int | str, degrees: float, width: int, height: int) -> list[FloatMaps]:
    """Return the maps of both cameras; the kind is "fisheye" or an angle of view of `LENSES`."""
    if kind == "fisheye":
        return fisheye_maps(rng, degrees, width, height)
    return lens_maps(rng, int(kind), degrees, width, height)


#: Kinds of lenses.
KINDS: tuple[int | str, ...] = (*LENSES, "fisheye")


class RigDraws(Draws):
    """Draw rigs: kind of the lens, misalignment, size of the images.

    The sizes begin where every setting of `OpenCVDraws` with 32 disparities and blocks of 11 has pixels to match.

    Parameters
    ----------
    rng
        It seeds the draws.
    most_columns
        Columns of the widest images; the highest ones have three quarters as many rows.
    """

    def __init__(self, rng: Rng, most_columns: int = 640) -> None:
        super().__init__(rng, {"kind": Range(0, len(KINDS) - 1), "tenths": Range(0, 50),
                               "width": Range(64, most_columns), "percent": Range(25, 75)},
                         {"tenths": (5, 10, 20, 30), "width": (80, 96, 97, 128, 145, 160)})

    def rig(self) -> tuple[int | str, float, int, int]:
        """Draw a kind of `KINDS`, degrees of misalignment, columns and rows."""
        width = self("width")
        return KINDS[self("kind")], self("tenths")/10, width, width*self("percent")//100


def raw_pair(pair: Pair, grids: Sequence[Grid], rng: np.random.Generator) -> Pair:
    """Return what cameras with the maps of `grids` see of a pair (uint8, H x W each): noise where it is not."""
    left, right = (_raw_image(image, grid, rng) for image, grid in zip(pair, grids, strict=True))
    return left, right


def _raw_image(image: NDArray[np.uint8], grid: Grid, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Put each pixel to the nearest place from which it is rectified."""
    raw         = rng.choice([0, 255, *range(256)], image.shape).astype(np.uint8)
    column, row = (values + ONE//2 >> 5 for values in grid.expand())
    seen        = (column >= 0) & (column < grid.width) & (row >= 0) & (row < grid.height)
    raw[row[seen], column[seen]] = image[seen]
    return raw
