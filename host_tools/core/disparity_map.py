#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A disparity map with all that is needed to use it: what its numbers mean, its cameras, and its share of the images.

Filters take and return such maps. Most change only the numbers. `decimated` makes a smaller map, whose pixels are
larger: each number that counts in pixels changes with them.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from .errors import ImageError
from .geometry import StereoGeometry
from .images import disparity_pixels
from .settings import DISPARITY_STEP, MatcherSettings

Image = TypeVar("Image", NDArray[np.uint8], NDArray[np.uint16])


@dataclass(frozen=True, eq=False)
class DisparityMap:
    """A disparity map, and what belongs to it.

    Parameters
    ----------
    disparity
        int16, H x W, in sixteenths of a pixel of this map; `settings.invalid` where there is none.
    settings
        Range of the disparities in pixels of this map. At `factor` 1 it is what the pair was matched with.
    geometry
        The cameras, with their lengths in pixels of this map; None if they are not known.
    factor
        Rows and columns of the images in each row and column of this map: 1 unless it is decimated.
    """

    disparity: NDArray[np.int16]
    settings:  MatcherSettings
    geometry:  StereoGeometry | None = None
    factor:    int = 1

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Where there is a disparity: bool, H x W."""
        return np.asarray(self.disparity > self.settings.invalid)

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The disparities in pixels of this map: float32, H x W, nan where there is none."""
        return disparity_pixels(self.disparity, self.settings.invalid)

    def depth_m(self) -> NDArray[np.float32] | None:
        """Return the depth: float32, H x W, in metres, nan where there is none; None without cameras."""
        if self.geometry is None:
            return None
        depth                  = self.geometry.depth_m(self.pixels)
        depth[np.isinf(depth)] = np.nan
        return depth

    def with_values(self, sixteenths: NDArray[np.floating], valid: NDArray[np.bool_]) -> DisparityMap:
        """Return this map with other disparities.

        Parameters
        ----------
        sixteenths
            float, H x W, in sixteenths of a pixel: rounded to the nearest one, and halves to the even one.
        valid
            Where there is a disparity: bool, H x W. Numbers elsewhere do not count.
        """
        numbers = np.where(valid, np.rint(sixteenths), self.settings.invalid)
        return dataclasses.replace(self, disparity=numbers.astype(np.int16))

    def picture(self, image: Image) -> Image:
        """Return an image (H x W, or H x W x 3) in the size of this map: each pixel is the mean of those it is made of.

        Rows and columns that are in no pixel of the map are cut off. At `factor` 1 it is the image itself.
        """
        if self.factor == 1:
            return image
        height, width = self.disparity.shape
        whole         = image[:height*self.factor, :width*self.factor]
        return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), image.dtype)

    def in_images(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Return the disparities in the size and the pixels of the images.

        Parameters
        ----------
        shape
            Rows and columns of the images.

        Returns
        -------
        float32, H x W, in pixels of the images: all pixels of one of this map have its disparity. nan where there is
        none, and in rows and columns that are in no pixel of the map.
        """
        grown = self.pixels.repeat(self.factor, axis=0).repeat(self.factor, axis=1)*np.float32(self.factor)
        found = np.full(shape[:2], np.nan, np.float32)
        found[:grown.shape[0], :grown.shape[1]] = grown
        return found


def decimated(map_: DisparityMap, factor: int, sixteenths: NDArray[np.floating], valid: NDArray[np.bool_]
              ) -> DisparityMap:
    """Return a map with pixels `factor` times as wide and as high.

    Lengths in pixels, such as disparities, range and focal length, are divided by `factor`. The centre of a pixel is at
    whole numbers, so a column x becomes (x + 0.5)/factor - 0.5.

    Parameters
    ----------
    factor
        At least 1.
    sixteenths
        float, H/factor x W/factor, in sixteenths of a pixel of `map_`.
    valid
        Where there is a disparity: bool, of the same size.
    """
    settings, geometry = map_.settings, map_.geometry
    least     = settings.min_disparity//factor
    most      = -(-(settings.min_disparity + settings.disparities - 1)//factor)
    range_    = -(-(most - least + 1)//DISPARITY_STEP)*DISPARITY_STEP
    smaller   = DisparityMap(map_.disparity[:valid.shape[0], :valid.shape[1]],
                             dataclasses.replace(settings, min_disparity=least, disparities=range_),
                             None if geometry is None else decimated_geometry(geometry, factor, valid.shape),
                             map_.factor*factor)
    return smaller.with_values(sixteenths/factor, valid)


def decimated_geometry(geometry: StereoGeometry, factor: int, shape: tuple[int, ...]) -> StereoGeometry:
    """Return the cameras of a map, H x W, whose pixels are `factor` times as wide and as high."""
    if factor == 1:
        return geometry
    return dataclasses.replace(
        geometry,
        width       = shape[1],
        height      = shape[0],
        focal_px    = geometry.focal_px/factor,
        focal_y_px  = geometry.focal_y_px/factor,
        cx_left_px  = (geometry.cx_left_px + 0.5)/factor - 0.5,
        cx_right_px = (geometry.cx_right_px + 0.5)/factor - 0.5,
        cy_px       = (geometry.cy_px + 0.5)/factor - 0.5,
    )


def check_size(map_: DisparityMap, factor: int) -> None:
    """Raise ImageError if a map has fewer rows or columns than `factor`."""
    height, width = map_.disparity.shape
    if min(height, width) < factor:
        raise ImageError(f"a map of {width}x{height} pixels cannot be decimated by {factor}")
