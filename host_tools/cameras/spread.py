#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Whether the places of a board determine a camera: its tilt, its distance, its area, the error of the focal length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from ..core.errors import GeometryError

#: Least angle between two places of the board, in degrees. Parallel boards do not determine a focal length, and the
#: estimate of an angle has an error of some degrees.
_LEAST_TILT_DEG = 10.0

#: Least movement of the board, relative to the image's diagonal; with less it was in one place.
_LEAST_MOVED = 0.03

#: Least share of an image that the corners of all pairs together cover.
_LEAST_COVERED = 0.05

#: Largest standard deviation of the focal length, relative.
_MOST_FOCAL_ERROR = 0.05

#: Least assumed error of a corner, in pixels.
_LEAST_NOISE_PX = 0.05

#: Coefficients of distortion whose errors count; more would be uncertain in any set.
_COEFFICIENTS = 4

@dataclass(frozen=True)
class Spread:
    """How different the places of a board are, in the worse of both cameras.

    Parameters
    ----------
    tilt_deg
        Largest angle between two places of the board, in degrees.
    moved
        Largest movement of the board's outline between two places: root mean square, relative to the image's diagonal.
    near_m, far_m
        Least and largest distance of the board, in metres.
    covered
        Share of the image in the outline of all corners: 0 to 1.
    focal_error
        Standard deviation of the focal length, relative to it.
    """

    tilt_deg:    float
    moved:       float
    near_m:      float
    far_m:       float
    covered:     float
    focal_error: float

    def __str__(self) -> str:
        """The places in one line."""
        return (f"board tilted by up to {self.tilt_deg:.0f} degrees, {self.near_m:.2f} to {self.far_m:.2f} m away, in "
                f"{self.covered:.0%} of the image")

    def check(self, side: str) -> None:
        """Raise GeometryError if the places do not determine the camera; `side` is left or right."""
        if self.tilt_deg < _LEAST_TILT_DEG and self.moved < _LEAST_MOVED:
            fault = "all of them show the board in one place"
        elif self.tilt_deg < _LEAST_TILT_DEG:
            fault = f"the board was not tilted, its places are parallel within {self.tilt_deg:.0f} degrees"
        elif self.covered < _LEAST_COVERED:
            fault = f"the board was in {self.covered:.0%} of the image only"
        # Not above: nan of places that determine nothing.
        elif not self.focal_error <= _MOST_FOCAL_ERROR:
            fault = f"the focal length is uncertain by {self.focal_error:.0%}"
        else:
            return
        raise GeometryError(f"these pairs do not determine the {side} camera: {fault} ({self}): take ten or more with "
                            "the board near and far, tilted by 20 to 40 degrees each way, in all corners of the image")


def measure_spread(points_m: Sequence[NDArray[np.float32]], pixels: Sequence[NDArray[np.float32]],
                   size: tuple[int, int], matrix: MatLike, distortion: MatLike, rotations: Sequence[MatLike],
                   shifts_m: Sequence[MatLike], rms_px: float) -> Spread:
    """Measure how well the places of a board determine a camera.

    Parameters
    ----------
    points_m, pixels
        Corners of each place: float32, N x 3, on the board, and float32, N x 2, in the image.
    size
        Width and height of the image in pixels.
    matrix, distortion, rotations, shifts_m, rms_px
        What `cv2.calibrateCamera` returns for them.
    """
    normals = np.stack([cv2.Rodrigues(rotation)[0][:, 2] for rotation in rotations])
    tilt    = np.degrees(np.arccos(np.clip(normals @ normals.T, -1, 1).min()))
    centres = np.stack([cv2.Rodrigues(rotation)[0] @ points.mean(axis=0) + np.ravel(shift)
                        for rotation, shift, points in zip(rotations, shifts_m, points_m, strict=True)])
    away    = np.linalg.norm(centres, axis=1)
    board   = np.concatenate(list(points_m))
    outline = np.array([(x, y, 0) for x in (board[:, 0].min(), board[:, 0].max())
                        for y in (board[:, 1].min(), board[:, 1].max())], np.float32)
    # As the camera sees it: a wrong focal length fits the image, too.
    seen    = np.stack([cv2.projectPoints(outline, rotation, shift, matrix, distortion)[0].reshape(-1)
                        for rotation, shift in zip(rotations, shifts_m, strict=True)])
    moved   = np.linalg.norm(seen[:, None] - seen, axis=2).max()/np.sqrt(len(outline))/np.hypot(*size)
    covered = cv2.contourArea(cv2.convexHull(np.concatenate(list(pixels)))) / (size[0]*size[1])
    error   = _focal_error_px(points_m, matrix, distortion, rotations, shifts_m)*max(rms_px, _LEAST_NOISE_PX)
    return Spread(float(tilt), float(moved), float(away.min()), float(away.max()), min(1.0, float(covered)),
                  float(error/matrix[0, 0]))


def _focal_error_px(points_m: Sequence[NDArray[np.float32]], matrix: MatLike, distortion: MatLike,
                    rotations: Sequence[MatLike], shifts_m: Sequence[MatLike]) -> float:
    """Return the standard deviation of the focal length for an error of 1 pixel in the corners; nan if undetermined.

    `cv2.calibrateCameraExtended` has one too, which is 0 or nan for badly conditioned sets.
    """
    wanted      = 4 + _COEFFICIENTS
    information = np.zeros((wanted, wanted))
    for points, rotation, shift in zip(points_m, rotations, shifts_m, strict=True):
        jacobian      = np.asarray(cv2.projectPoints(points, rotation, shift, matrix, distortion)[1], np.float64)
        place, camera = jacobian[:, :6], jacobian[:, 6:6 + wanted]
        # What the place of the board explains as well does not count.
        rest          = camera - place @ np.linalg.lstsq(place, camera, rcond=None)[0]
        information  += rest.T @ rest
    # Parameters of different units: relative to their own.
    scale = np.sqrt(np.diag(information))
    if not (np.isfinite(scale) & (scale > 0)).all():
        return float(np.nan)
    values, vectors = np.linalg.eigh(information/np.outer(scale, scale))
    variance        = np.square(vectors[0]) @ (1/np.maximum(values, np.finfo(np.float64).eps))
    return float(np.sqrt(variance)/scale[0])
