#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From disparity to metres: the geometry of a rectified pair of cameras."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import GeometryError


@dataclass(frozen=True)
class StereoGeometry:
    """A rectified pair of cameras: same focal length, same rows, one beside the other.

    Parameters
    ----------
    width, height
        Size of the images in pixels.
    focal_px
        Focal length in pixels.
    baseline_m
        Distance of the cameras in metres, above 0.
    cx_left_px, cy_px
        Principal point of the left camera in pixels; the row is that of both.
    cx_right_px
        Column of the right camera's principal point; other than `cx_left_px` if the cameras converge.

    Raises
    ------
    GeometryError
        A value that no pair of cameras has.
    """

    width:       int
    height:      int
    focal_px:    float
    baseline_m:  float
    cx_left_px:  float
    cy_px:       float
    cx_right_px: float

    def __post_init__(self) -> None:
        for name in ("width", "height", "focal_px", "baseline_m"):
            if not 0 < getattr(self, name) < math.inf:
                raise GeometryError(f"{name} must be above 0, not {getattr(self, name)}")
        for name in ("cx_left_px", "cy_px", "cx_right_px"):
            if not math.isfinite(getattr(self, name)):
                raise GeometryError(f"{name} must be a number, not {getattr(self, name)}")

    @property
    def zero_px(self) -> float:
        """Disparity in pixels of what is infinitely far away."""
        return self.cx_left_px - self.cx_right_px

    def q(self) -> NDArray[np.float64]:
        """Reprojection matrix Q, float64, 4 x 4: `cv2.stereoRectify` gives it, `cv2.reprojectImageTo3D` takes it."""
        return np.array([
            [1, 0, 0, -self.cx_left_px],
            [0, 1, 0, -self.cy_px],
            [0, 0, 0, self.focal_px],
            [0, 0, 1/self.baseline_m, -self.zero_px/self.baseline_m],
        ], np.float64)

    def depth_m(self, disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance from the cameras' plane.

        Parameters
        ----------
        disparity_px
            float32, H x W, in pixels, nan where there is none: see `images.disparity_pixels`.

        Returns
        -------
        float32, H x W, in metres, nan where there is no disparity, inf where it is that of infinity or less.
        """
        above = disparity_px.astype(np.float64) - self.zero_px
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.where(above > 0, self.focal_px*self.baseline_m/above, np.inf)
        depth[np.isnan(above)] = np.nan
        return depth.astype(np.float32)

    def points_m(self, disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Points in space, seen from the left camera: x to the right, y down, z ahead.

        Parameters
        ----------
        disparity_px
            float32, H x W, in pixels, nan where there is none.

        Returns
        -------
        float32, H x W x 3, in metres, nan where there is no disparity or the depth is infinite.
        """
        z = self.depth_m(disparity_px).astype(np.float64)
        z[np.isinf(z)] = np.nan
        rows, columns = np.mgrid[0:z.shape[0], 0:z.shape[1]]
        return np.stack([(columns - self.cx_left_px)*z/self.focal_px,
                         (rows - self.cy_px)*z/self.focal_px, z], axis=-1).astype(np.float32)
