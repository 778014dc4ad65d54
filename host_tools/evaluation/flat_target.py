#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures of a flat target: distance, plane, flatness, noise and holes of a region of a depth map.

They are those of the Depth Quality Tool of librealsense 2 (tools/depth-quality: readme.md, rs-depth-quality.cpp and
depth-metrics.h), by its definitions: fill rate, distance, plane fit RMS error, subpixel RMS error and Z accuracy.
Flatness and noise over time are added.

Point the cameras at a wall or a board with texture, as squarely as possible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError, UsageError
from ..core.geometry import StereoGeometry

#: All figures, and what they are.
FIGURES = {
    "fill_rate":          "pixels of the region that have a depth, %",
    "depth_m":            "median depth, metres",
    "plane_distance_m":   "distance of the left camera from the plane, metres",
    "axis_depth_m":       "depth of the plane on the optical axis of the left camera, metres",
    "angle_deg":          "angle between the normal of the plane and the optical axis, degrees",
    "plane_rms_m":        "root mean square of the points' distances from the plane, metres",
    "subpixel_rms_px":    "root mean square of the differences in disparity between points and plane, pixels",
    "flatness_m":         "distance of the two parallels of the plane that enclose the points, metres",
    "z_accuracy_percent": "median error of the depth, % of the true distance; above 0 it is too large",
}

#: Figures over all frames.
TEMPORAL_FIGURES = {
    "temporal_noise_m":  "median of the pixels' standard deviations of the depth over the frames, metres",
    "temporal_noise_px": "the same of the disparity, pixels",
}

#: Of so many points one with the least depth and one with the largest do not count: 0.5 % at each end.
_POINTS_PER_OUTLIER = 200

#: Share of the width and of the height that the region has by default.
_MIDDLE = 0.4


@dataclass(frozen=True)
class Region:
    """A rectangle of a map: column and row of its first pixel, width and height, in pixels.

    Raises
    ------
    UsageError
        The first pixel is at less than 0, or the size less than 1.
    """

    x:      int
    y:      int
    width:  int
    height: int

    def __post_init__(self) -> None:
        if min(self.x, self.y) < 0 or min(self.width, self.height) < 1:
            raise UsageError(f"a region has a column and a row from 0 on, a width and a height from 1 on, not {self}")

    def __str__(self) -> str:
        return f"{self.width}x{self.height} pixels at column {self.x}, row {self.y}"

    @classmethod
    def middle(cls, width: int, height: int) -> Region:
        """Return the middle of a map of `width` x `height` pixels: 40 % of its width and its height."""
        size = [max(1, round(_MIDDLE*side)) for side in (width, height)]
        return cls((width - size[0])//2, (height - size[1])//2, *size)

    def decimated(self, factor: int) -> Region:
        """Return the region in pixels that are `factor` times as wide and as high."""
        x, y = self.x//factor, self.y//factor
        return Region(x, y, max(1, (self.x + self.width)//factor - x), max(1, (self.y + self.height)//factor - y))

    def check(self, width: int, height: int) -> None:
        """Raise ImageError if the region is not within a map of `width` x `height` pixels."""
        if self.x + self.width > width or self.y + self.height > height:
            raise ImageError(f"the region of {self} is not within the map of {width}x{height} pixels")

    def of(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the part of an array, H x W or H x W x N, that is in the region."""
        return values[self.y:self.y + self.height, self.x:self.x + self.width]


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane in the frame of the left camera: the points with normal . point = distance_m.

    `normal` is float64, 3, of length 1, and directed away from the camera; `distance_m` is 0 or more.
    """

    normal:     NDArray[np.float64]
    distance_m: float

    def errors_m(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the signed distances of points (N x 3, metres) from the plane, above 0 if they are farther."""
        return np.asarray(points_m @ self.normal - self.distance_m)


def fit_plane(points_m: NDArray[np.float64]) -> Plane | None:
    """Fit a plane to points, float64, N x 3, in metres: the sum of the squared distances from it is least.

    Returns
    -------
    The plane; None if the points are fewer than 3, or in one line.
    """
    if len(points_m) < 3:
        return None
    centre = points_m.mean(axis=0)
    # Of the scatter of the points the eigenvector of the least eigenvalue is normal to the plane.
    values, vectors = np.linalg.eigh((points_m - centre).T @ (points_m - centre))
    if values[1] <= 1e-12*values[2] or values[2] == 0:
        return None
    normal = vectors[:, 0]
    if normal @ centre < 0:
        normal = -normal
    return Plane(normal, float(normal @ centre))


def measure_region(disparity_px: NDArray[np.float32], geometry: StereoGeometry, region: Region,
                   true_distance_m: float | None = None) -> dict[str, float]:
    """Measure one map in a region.

    - Fill rate: the pixels that have a depth, in percent of all pixels of the region.
    - Plane: fitted to all points of the region. What follows is without outliers: 0.5 % of the points with the least
      depth, and 0.5 % of those with the largest.
    - Plane fit RMS error: sqrt(mean(e_i^2)), where e_i is the distance of point i from the plane.
    - Subpixel RMS error: sqrt(mean((D_i - Dp_i)^2)), where D_i = B*f/Z_i and Dp_i = B*f/Zp_i: Z_i is the depth of
      point i, and Zp_i that of its projection onto the plane.
    - Flatness: the largest e_i minus the smallest one.
    - Z accuracy: the plane is moved and rotated onto the true plane, which is at right angles to the optical axis. The
      depth of point i is then the depth of the plane on the axis plus e_i; it is the median of the differences from the
      true distance, in percent of that.

    Parameters
    ----------
    disparity_px
        float32, H x W, in pixels, nan where there is none.
    geometry
        The cameras, in pixels of the map.
    true_distance_m
        Distance of the target along the optical axis in metres; None if it is not known.

    Returns
    -------
    The figures by the names in `FIGURES`; nan where there is none: without points, without a plane, or without the true
    distance.

    Raises
    ------
    ImageError
        The region is not within the map.
    """
    region.check(disparity_px.shape[1], disparity_px.shape[0])
    all_points = region.of(geometry.points_m(disparity_px)).reshape(-1, 3).astype(np.float64)
    points     = all_points[np.isfinite(all_points).all(axis=1)]
    values     = dict.fromkeys(FIGURES, math.nan)
    values["fill_rate"] = 100*len(points)/len(all_points)
    if len(points):
        values["depth_m"] = float(np.median(points[:, 2]))
    plane = fit_plane(points)
    if plane is None:
        return values
    cut    = len(points)//_POINTS_PER_OUTLIER
    kept   = points[np.argsort(points[:, 2], kind="stable")][cut:len(points) - cut]
    errors = plane.errors_m(kept)
    slope  = float(plane.normal[2])
    values |= {
        "plane_distance_m": plane.distance_m,
        "angle_deg":        math.degrees(math.acos(min(abs(slope), 1.0))),
        "plane_rms_m":      _rms(errors),
        "subpixel_rms_px":  _rms(geometry.focal_px*geometry.baseline_m*(1/kept[:, 2] - 1/(kept[:, 2] - errors*slope))),
        "flatness_m":       float(errors.max() - errors.min()),
    }
    if slope > 0:
        values["axis_depth_m"] = plane.distance_m/slope
        if true_distance_m is not None:
            errors_m = values["axis_depth_m"] + errors - true_distance_m
            values["z_accuracy_percent"] = 100*float(np.median(errors_m))/true_distance_m
    return values


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(values**2)))


class TemporalNoise:
    """How much each pixel of a region changes from frame to frame, in memory that does not grow with their number.

    The noise is the standard deviation of a pixel over the frames in which it has a value, and of that the median over
    the pixels. Pixels with a value in less than half of the frames, or in less than two, do not count.
    """

    def __init__(self) -> None:
        self.frames = 0
        self._counts: NDArray[np.int64] | None = None
        self._means   = np.empty(0)
        self._squares = np.empty(0)

    def add(self, values: NDArray[np.float32]) -> None:
        """Add a frame: float32, H x W, nan or inf where there is no value. All frames have one size."""
        if self._counts is None:
            self._counts  = np.zeros(values.shape, np.int64)
            self._means   = np.zeros(values.shape)
            self._squares = np.zeros(values.shape)
        known  = np.isfinite(values)
        self.frames  += 1
        self._counts += known
        # B. P. Welford, Note on a method for calculating corrected sums of squares and products, Technometrics 4, 1962.
        number        = np.where(known, values, 0).astype(np.float64)
        before        = np.where(known, number - self._means, 0)
        self._means   += before/np.maximum(self._counts, 1)
        self._squares += before*np.where(known, number - self._means, 0)

    @property
    def noise(self) -> float:
        """The noise, in the unit of the values; nan if no pixel has one."""
        if self._counts is None:
            return math.nan
        steady = self._counts >= max(2, self.frames/2)
        if not steady.any():
            return math.nan
        return float(np.median(np.sqrt(self._squares[steady]/self._counts[steady])))


class RegionMeter:
    """Measures a region in frames that follow each other.

    Parameters
    ----------
    region
        The region in pixels of the images; None for the middle.
    true_distance_m
        Distance of the target along the optical axis in metres; None if it is not known.
    """

    def __init__(self, region: Region | None, true_distance_m: float | None) -> None:
        self._region   = region
        self._true_m   = true_distance_m
        self._sums     = dict.fromkeys(FIGURES, 0.0)
        self._counts   = dict.fromkeys(FIGURES, 0)
        self._depth    = TemporalNoise()
        self._pixels   = TemporalNoise()
        #: The region in pixels of the maps; None before the first one.
        self.measured: Region | None = None

    @property
    def frames(self) -> int:
        """Number of frames so far."""
        return self._depth.frames

    def add(self, disparity_px: NDArray[np.float32], geometry: StereoGeometry, factor: int = 1) -> None:
        """Measure a map.

        Parameters
        ----------
        disparity_px
            float32, H x W, in pixels, nan where there is none. All maps have one size.
        geometry
            The cameras, in pixels of the map.
        factor
            Rows and columns of the images in each of the map.

        Raises
        ------
        ImageError
            The region is not within the map.
        """
        height, width = disparity_px.shape
        region        = (Region.middle(width, height) if self._region is None
                         else self._region.decimated(factor) if factor > 1 else self._region)
        figures       = measure_region(disparity_px, geometry, region, self._true_m)
        for name, value in figures.items():
            if not math.isnan(value):
                self._sums[name]   += value
                self._counts[name] += 1
        self._depth.add(region.of(geometry.depth_m(disparity_px)))
        self._pixels.add(region.of(disparity_px))
        self.measured = region

    def figures(self) -> dict[str, float]:
        """Return the figures by the names in `FIGURES`, each the mean over the frames that have it, and those over all
        frames by the names in `TEMPORAL_FIGURES`; nan where there is none.
        """
        means = {name: self._sums[name]/count if count else math.nan for name, count in self._counts.items()}
        return means | {"temporal_noise_m": self._depth.noise, "temporal_noise_px": self._pixels.noise}


def figure_texts(figures: dict[str, float], true_distance_m: float | None) -> Sequence[tuple[str, str]]:
    """Return the figures that there are, for people: labels and texts."""
    def text(name: str, form: str) -> str:
        return "none" if math.isnan(figures[name]) else form.format(figures[name])

    lines = [
        ("fill rate",  f"{figures['fill_rate']:.2f} % of the pixels have a depth"),
        ("depth",      text("depth_m", "{:.4f} m, median")),
        ("plane",      f"{text('plane_distance_m', '{:.4f} m')} from the left camera, "
                       f"{text('angle_deg', '{:.2f} degrees')} off, {text('axis_depth_m', '{:.4f} m')} on the axis"),
        ("plane RMS",  f"{text('plane_rms_m', '{:.5f} m')}, {text('subpixel_rms_px', '{:.4f} pixels')}"),
        ("flatness",   text("flatness_m", "{:.5f} m")),
    ]
    if true_distance_m is not None:
        lines.append(("Z accuracy", text("z_accuracy_percent", "{:+.3f} % of ") + f"{true_distance_m:g} m"))
    if not math.isnan(figures["temporal_noise_m"]):
        noise = f"{figures['temporal_noise_m']:.5f} m, {figures['temporal_noise_px']:.4f} pixels"
        lines.append(("noise", f"{noise}, over time"))
    return lines
