#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Drawn pairs of cameras, as cheap rigs have them, and the maps that rectify them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.cameras.camera_info import CameraInfo

#: Focal length in pixels at 640 columns, k1, k2, deviation of p1 and p2, k3, by the angle of view in degrees.
LENSES = {
    44: (800, -0.25, 0.15, 0.0010, 0.0),
    60: (560, -0.35, 0.16, 0.0012, -0.04),
    77: (400, -0.32, 0.13, 0.0012, -0.025),
    90: (320, -0.30, 0.10, 0.0015, -0.015),
}

BASELINE_M = 0.06

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
