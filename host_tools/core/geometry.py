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
    """A rectified pair of cameras, side by side: both have the same focal lengths and rows.

    Parameters
    ----------
    width, height
        Size of the images in pixels.
    focal_px
        Focal length in pixels, along the rows.
    baseline_m
        Distance of the cameras in metres, above 0.
    cx_left_px, cy_px
        Principal point of the left camera in pixels: column, and row, which is that of both cameras.
    cx_right_px
        Column of the right camera's principal point in pixels; it differs from `cx_left_px` if the cameras converge.
    focal_y_px
        Focal length in pixels, down the columns; it differs from `focal_px` if pixels are not square. 0, the default,
        becomes `focal_px`.

    Raises
    ------
    GeometryError
        A size, focal length or baseline that is not above 0, or a value that is not finite.
    """

    width:       int
    height:      int
    focal_px:    float
    baseline_m:  float
    cx_left_px:  float
    cy_px:       float
    cx_right_px: float
    focal_y_px:  float = 0.0

    def __post_init__(self) -> None:
        if self.focal_y_px == 0:
            object.__setattr__(self, "focal_y_px", self.focal_px)
        for name in ("width", "height", "focal_px", "focal_y_px", "baseline_m"):
            if not 0 < getattr(self, name) < math.inf:
                raise GeometryError(f"{name} must be above 0, not {getattr(self, name)}")
        for name in ("cx_left_px", "cy_px", "cx_right_px"):
            if not math.isfinite(getattr(self, name)):
                raise GeometryError(f"{name} must be a number, not {getattr(self, name)}")

    @property
    def zero_px(self) -> float:
        """Disparity of a point at infinity, in pixels: 0 unless the cameras converge."""
        return self.cx_left_px - self.cx_right_px

    def q(self) -> NDArray[np.float64]:
        """Return the reprojection matrix Q, float64, 4 x 4, as `cv2.stereoRectify` returns it.

        `cv2.reprojectImageTo3D` converts disparities in pixels to points in metres with it.
        """
        aspect = self.focal_px/self.focal_y_px
        return np.array([
            [1, 0, 0, -self.cx_left_px],
            [0, aspect, 0, -aspect*self.cy_px],
            [0, 0, 0, self.focal_px],
            [0, 0, 1/self.baseline_m, -self.zero_px/self.baseline_m],
        ], np.float64)

    def depth_m(self, disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the depth, the distance from the plane of the cameras: focal_px*baseline_m/(d - zero_px).

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
        """Return the points in space, in the frame of the left camera: x to the right, y down, z ahead.

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
                         (rows - self.cy_px)*z/self.focal_y_px, z], axis=-1).astype(np.float32)
