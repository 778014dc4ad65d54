#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Calibrates a pair of cameras from images of a board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError
from .camera_info import CameraInfo
from .find import BadPair, BoardPair

#: Least number of pairs that determine two cameras.
MIN_PAIRS = 3

#: A pair is bad if its error is above this many times the median, and above this many pixels.
_BAD_FACTOR = 3.0
_BAD_PX     = 0.5

#: Largest share of the pairs that is removed as bad: if there are more, the cause is elsewhere.
_MOST_BAD = 1/3

#: Distortion models by ROS's names, and OpenCV's flags for them. The third radial coefficient of the first model stays
#: 0: it fits the noise, except with wide lenses, which need the second model.
MODELS = {"plumb_bob": cv2.CALIB_FIX_K3, "rational_polynomial": cv2.CALIB_RATIONAL_MODEL}

#: Number of coefficients of each model.
_COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8}

#: Least baseline, in metres: with a smaller one both folders show the same camera.
_LEAST_BASELINE_M = 1e-4

_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-7)


@dataclass(frozen=True)
class PairErrors:
    """Errors of a pair.

    Parameters
    ----------
    name
        Name of the pair.
    corners
        Number of corners that both images show.
    left_px, right_px
        Reprojection error of each camera: root mean square over the corners, in pixels.
    epipolar_px
        Mean distance of the rows of a corner in the two rectified images, in pixels.
    """

    name:        str
    corners:     int
    left_px:     float
    right_px:    float
    epipolar_px: float

    @property
    def reprojection_px(self) -> float:
        """The larger reprojection error of the two cameras."""
        return max(self.left_px, self.right_px)


@dataclass(frozen=True)
class Calibration:
    """A calibrated pair of cameras, and its errors.

    Parameters
    ----------
    left, right
        The cameras.
    reprojection_px, epipolar_px
        Errors over all pairs that were used, in pixels: see `PairErrors`.
    pairs
        Errors of each pair that was used.
    bad
        Pairs that were not used.
    """

    left:            CameraInfo
    right:           CameraInfo
    reprojection_px: float
    epipolar_px:     float
    pairs:           tuple[PairErrors, ...]
    bad:             tuple[BadPair, ...]


def calibrate(pairs: Sequence[BoardPair], width: int, height: int, model: str = "plumb_bob", alpha: float = 0.0,
              keep_all: bool = False) -> Calibration:
    """Calibrate a pair of cameras with OpenCV's `stereoCalibrate`, which minimizes the reprojection error.

    Each camera is calibrated alone first, by Z. Zhang, A flexible new technique for camera calibration, PAMI 2000. The
    worst pair is removed, and the calibration repeated, while it is bad.

    Parameters
    ----------
    pairs
        At least 3, from images of `width` x `height` pixels.
    model
        Distortion: "plumb_bob" or "rational_polynomial".
    alpha
        0 to keep only pixels that both lenses cover in the rectified images, 1 to keep all that they cover.
    keep_all
        Whether to keep pairs that fit much worse than the others.

    Raises
    ------
    GeometryError
        There are too few pairs, or the cameras are not one beside the other.
    """
    used, bad = list(pairs), list[BadPair]()
    least     = max(MIN_PAIRS, round((1 - _MOST_BAD)*len(used)))
    if len(used) < MIN_PAIRS:
        raise GeometryError(f"{len(used)} pairs show the pattern, at least {MIN_PAIRS} are needed, 10 to 30 are good")
    while True:
        result = _solve(used, (width, height), model, alpha)
        worst  = max(result.pairs, key=lambda errors: errors.reprojection_px)
        middle = float(np.median([errors.reprojection_px for errors in result.pairs]))
        if keep_all or len(used) <= least or worst.reprojection_px <= max(_BAD_PX, _BAD_FACTOR*middle):
            break
        bad.append(BadPair(worst.name, f"reprojection error {worst.reprojection_px:.2f} pixels, of the others "
                                       f"{middle:.2f}"))
        # By its index: two pairs may have the same name.
        del used[result.pairs.index(worst)]
    return Calibration(result.left, result.right, result.reprojection_px, result.epipolar_px, result.pairs,
                       tuple(bad))


def _solve(pairs: Sequence[BoardPair], size: tuple[int, int], model: str, alpha: float) -> Calibration:
    """Calibrate with all of `pairs`, of images of `size`, width and height in pixels; raise as `calibrate`."""
    points = [pair.points_m for pair in pairs]
    left   = [pair.left_px for pair in pairs]
    right  = [pair.right_px for pair in pairs]
    flags  = MODELS[model]
    first  = [cv2.calibrateCamera(points, pixels, size, None, None, flags=flags, criteria=_CRITERIA)
              for pixels in (left, right)]
    solved = cv2.stereoCalibrateExtended(
        points, left, right, first[0][1], first[0][2], first[1][1], first[1][2], size, np.eye(3), np.zeros((3, 1)),
        flags=flags | cv2.CALIB_USE_INTRINSIC_GUESS, criteria=_CRITERIA)
    rms, k_left, d_left, k_right, d_right, rotation, shift = solved[:7]
    per_pair = np.asarray(solved[-1], np.float64).reshape(len(pairs), 2)
    _check_shift(np.asarray(shift, np.float64).reshape(3))
    r_left, r_right, p_left, p_right = cv2.stereoRectify(
        k_left, d_left, k_right, d_right, size, rotation, shift, flags=cv2.CALIB_ZERO_DISPARITY, alpha=alpha)[:4]
    cameras = [CameraInfo(name, *size, np.asarray(k, np.float64), model,
                          np.asarray(d, np.float64).reshape(-1)[:_COEFFICIENTS[model]],
                          np.asarray(r, np.float64), np.asarray(p, np.float64))
               for name, k, d, r, p in (("left", k_left, d_left, r_left, p_left),
                                        ("right", k_right, d_right, r_right, p_right))]
    rows   = [[rectified_px(pair.left_px, cameras[0])[:, 1] - rectified_px(pair.right_px, cameras[1])[:, 1]]
              for pair in pairs]
    errors = tuple(PairErrors(pair.name, len(pair.points_m), float(per_pair[index, 0]), float(per_pair[index, 1]),
                              float(np.mean(np.abs(rows[index])))) for index, pair in enumerate(pairs))
    epipolar = float(np.mean(np.abs(np.concatenate(rows, axis=1))))
    return Calibration(cameras[0], cameras[1], float(rms), epipolar, errors, ())


def _check_shift(shift_m: NDArray[np.float64]) -> None:
    """Raise GeometryError unless the right camera is to the right of the left one; `shift_m` is T, float64, 3."""
    if np.abs(shift_m).max() < _LEAST_BASELINE_M:
        raise GeometryError("both cameras are at the same place: are the two folders of one camera?")
    if abs(shift_m[0]) <= max(abs(shift_m[1]), abs(shift_m[2])):
        raise GeometryError("the cameras are not one beside the other: the right one is "
                            f"{-shift_m[0]:.3f} m to the right, {-shift_m[1]:.3f} m below and "
                            f"{-shift_m[2]:.3f} m ahead")
    if shift_m[0] > 0:
        raise GeometryError("the right camera is to the left of the left one: swap the two folders")


def rectified_px(pixels: NDArray[np.float32], camera: CameraInfo) -> NDArray[np.float32]:
    """Map positions in an image (float32, N x 2, in pixels) to the rectified image; return the same type."""
    moved = cv2.undistortPoints(pixels.reshape(-1, 1, 2), camera.camera_matrix, camera.distortion,
                                R=camera.rectification, P=camera.projection)
    return np.asarray(moved, np.float32).reshape(-1, 2)
