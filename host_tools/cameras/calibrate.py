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
from .rectify import Rectifier
from .spread import Spread, measure_spread

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

#: Angle between the two cameras about their axes, in degrees, from which one is mounted in another way than the other.
_MOST_ROLL_DEG = 30.0

#: Largest reprojection error in pixels that `calibrate` accepts by default.
MAX_ERROR_PX = 1.0

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
    spread
        How different the places of the board are, by the camera that they determine worse.
    rectifier
        Rectifies the images of the cameras.
    """

    left:            CameraInfo
    right:           CameraInfo
    reprojection_px: float
    epipolar_px:     float
    pairs:           tuple[PairErrors, ...]
    bad:             tuple[BadPair, ...]
    spread:          Spread
    rectifier:       Rectifier


def calibrate(pairs: Sequence[BoardPair], width: int, height: int, model: str = "plumb_bob", alpha: float = 0.0,
              keep_all: bool = False, max_error_px: float = MAX_ERROR_PX) -> Calibration:
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
    max_error_px
        Largest reprojection error over all pairs, in pixels.

    Raises
    ------
    GeometryError
        There are too few pairs, they do not determine the cameras, the error is above `max_error_px`, the cameras are
        not one beside the other and the same way up, or nothing remains of the rectified images.
    """
    used, bad = list(pairs), list[BadPair]()
    least     = max(MIN_PAIRS, round((1 - _MOST_BAD)*len(used)))
    if len(used) < MIN_PAIRS:
        raise GeometryError(f"{len(used)} pairs show the pattern, at least {MIN_PAIRS} are needed, 10 to 30 are good")
    while True:
        solved = _solve(used, (width, height), model)
        worst  = int(np.argmax(solved.errors_px.max(axis=1)))
        error  = float(solved.errors_px[worst].max())
        middle = float(np.median(solved.errors_px.max(axis=1)))
        if keep_all or len(used) <= least or error <= max(_BAD_PX, _BAD_FACTOR*middle):
            break
        bad.append(BadPair(used[worst].name, f"reprojection error {error:.2f} pixels, of the others {middle:.2f}"))
        del used[worst]
    _check_each(solved, max_error_px)
    _check_both(solved, used, (width, height), model, max_error_px)
    return _rectified(solved, used, (width, height), model, alpha, bad)


@dataclass(frozen=True, eq=False)
class _Solution:
    """Two cameras, float64 throughout: matrix, distortion, then rotation and shift (T, in metres) of the right one.

    `errors_px` are the reprojection errors, N x 2, `rms_px` that of all, `alone_px` those of each camera without the
    other. `spreads` are of the left and the right camera.
    """

    matrices:    tuple[NDArray[np.float64], NDArray[np.float64]]
    distortions: tuple[NDArray[np.float64], NDArray[np.float64]]
    rotation:    NDArray[np.float64]
    shift_m:     NDArray[np.float64]
    errors_px:   NDArray[np.float64]
    rms_px:      float
    alone_px:    tuple[float, float]
    spreads:     tuple[Spread, Spread]


def _solve(pairs: Sequence[BoardPair], size: tuple[int, int], model: str) -> _Solution:
    """Find the cameras for all of `pairs`, of images of `size`, width and height in pixels.

    Raise GeometryError if OpenCV finds none.
    """
    points = [pair.points_m for pair in pairs]
    sides  = [pair.left_px for pair in pairs], [pair.right_px for pair in pairs]
    flags  = MODELS[model]
    try:
        first = [cv2.calibrateCamera(points, pixels, size, None, None, flags=flags, criteria=_CRITERIA)
                 for pixels in sides]
        found = cv2.stereoCalibrateExtended(
            points, *sides, first[0][1], first[0][2], first[1][1], first[1][2], size, np.eye(3), np.zeros((3, 1)),
            flags=flags | cv2.CALIB_USE_INTRINSIC_GUESS, criteria=_CRITERIA)
    except cv2.error:
        raise GeometryError("no cameras fit these pairs: take others, with the board near and far, tilted, and in all "
                            "corners of both images") from None
    values = [np.asarray(value, np.float64) for value in found[1:7]]
    count  = _COEFFICIENTS[model]
    errors = np.asarray(found[-1], np.float64).reshape(len(pairs), 2)
    if not all(np.isfinite(value).all() for value in (*values, errors)):
        raise GeometryError("no cameras fit these pairs: the numbers found are not finite")
    spreads = [measure_spread(points, pixels, size, one[1], one[2], one[3], one[4], one[0])
               for pixels, one in zip(sides, first, strict=True)]
    return _Solution((values[0], values[2]), (values[1].reshape(-1)[:count], values[3].reshape(-1)[:count]), values[4],
                     values[5].reshape(3), errors, float(found[0]), (float(first[0][0]), float(first[1][0])),
                     (spreads[0], spreads[1]))


def _check_each(solved: _Solution, max_error_px: float) -> None:
    """Raise GeometryError unless the pairs determine each camera by itself."""
    for side, error_px, spread in zip(("left", "right"), solved.alone_px, solved.spreads, strict=True):
        if error_px > max_error_px:
            raise GeometryError(f"the {side} images do not fit one camera: the reprojection error is {error_px:.2f} "
                                f"pixels, at most {max_error_px:g} are accepted (--max-error): check the size of the "
                                "pattern, and that the board is flat and focus and zoom stayed the same")
        spread.check(side)


def _check_both(solved: _Solution, pairs: Sequence[BoardPair], size: tuple[int, int], model: str,
                max_error_px: float) -> None:
    """Raise GeometryError unless the two cameras are one pair, one beside the other."""
    if solved.rms_px > max_error_px or abs(_roll_deg(solved)) > _MOST_ROLL_DEG:
        # A board that looks the same in several rotations was taken for one that is the same way up in both images.
        for index in range(min(len(pair.rotated_px) for pair in pairs)):
            other = _solve([pair.rotated(index) for pair in pairs], size, model)
            if other.rms_px <= max_error_px:
                _check_roll(other)
    _check_roll(solved)
    if solved.rms_px > max_error_px:
        raise GeometryError("each camera fits, but not as a pair: the reprojection error is "
                            f"{solved.rms_px:.2f} pixels, at most {max_error_px:g} are accepted (--max-error): left "
                            "and right images must be taken at the same moment, and the cameras be fixed to each other")
    _check_shift(solved.shift_m)


def _roll_deg(solved: _Solution) -> float:
    """Return by how much the right camera is rotated about its axis, in degrees."""
    return float(np.degrees(np.arctan2(solved.rotation[1, 0], solved.rotation[0, 0])))


def _check_roll(solved: _Solution) -> None:
    """Raise GeometryError if one camera is rotated about its axis: sideways or upside down."""
    roll_deg = abs(_roll_deg(solved))
    if roll_deg > _MOST_ROLL_DEG:
        raise GeometryError(f"one camera is rotated by {roll_deg:.0f} degrees to the other: rotate the images of the "
                            "one that is not upright, or mount it as the other")


def _rectified(solved: _Solution, pairs: Sequence[BoardPair], size: tuple[int, int], model: str, alpha: float,
               bad: Sequence[BadPair]) -> Calibration:
    """Return cameras that are rectified to each other, and the errors; raise GeometryError if that is impossible."""
    (k_left, k_right), (d_left, d_right) = solved.matrices, solved.distortions
    r_left, r_right, p_left, p_right = cv2.stereoRectify(
        k_left, d_left, k_right, d_right, size, solved.rotation, solved.shift_m.reshape(3, 1),
        flags=cv2.CALIB_ZERO_DISPARITY, alpha=alpha)[:4]
    cameras = [CameraInfo(name, *size, k, model, d, np.asarray(r, np.float64), np.asarray(p, np.float64))
               for name, k, d, r, p in (("left", k_left, d_left, r_left, p_left),
                                        ("right", k_right, d_right, r_right, p_right))]
    # It refuses what no command could use.
    rectifier = Rectifier(cameras[0], cameras[1])
    rows   = [rectified_px(pair.left_px, cameras[0])[:, 1] - rectified_px(pair.right_px, cameras[1])[:, 1]
              for pair in pairs]
    errors = tuple(PairErrors(pair.name, len(pair.points_m), float(left), float(right), float(np.mean(np.abs(apart))))
                   for pair, (left, right), apart in zip(pairs, solved.errors_px, rows, strict=True))
    return Calibration(cameras[0], cameras[1], solved.rms_px, float(np.mean(np.abs(np.concatenate(rows)))), errors,
                       tuple(bad), max(solved.spreads, key=lambda spread: spread.focal_error), rectifier)


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
