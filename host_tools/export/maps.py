#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reads disparity maps from files, and checks them against the range that was searched."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError, SettingsError
from ..core.images import KITTI_SCALE, disparity_pixels, read_file, read_image
from ..core.settings import DISPARITY_SCALE
from ..data.ground_truth import decode_pfm


@dataclass(frozen=True)
class SearchRange:
    """The range of disparities that was searched for a map; its file does not store it.

    Parameters
    ----------
    disparities, min_disparity
        Number of disparities searched and the smallest of them, in pixels.
    block_size
        Side of the block in pixels, odd.

    Raises
    ------
    SettingsError
        A value that no matcher accepts.
    """

    disparities:   int = 64
    min_disparity: int = 0
    block_size:    int = 9

    def __post_init__(self) -> None:
        if self.disparities < 1 or self.min_disparity < 0:
            raise SettingsError("the number of disparities must be at least 1, and the smallest one at least 0")
        if self.block_size < 1 or self.block_size % 2 == 0:
            raise SettingsError(f"the block size must be an odd number, from 1 on, not {self.block_size}")

    @property
    def invalid(self) -> int:
        """Value of a pixel without a disparity in an int16 map, in sixteenths of a pixel."""
        return (self.min_disparity - 1)*DISPARITY_SCALE

    @property
    def max_disparity(self) -> int:
        """The largest disparity searched, in pixels."""
        return self.min_disparity + self.disparities - 1

    def window(self, width: int, height: int) -> tuple[int, int, int, int]:
        """Return column, row, width and height of the valid region: the part of a map that can have disparities.

        Its size is 0 if there is none. It is what `cv2.getValidDisparityROI` returns for images that are valid
        everywhere.
        """
        margin = self.block_size//2
        x      = min(self.max_disparity + margin, width)
        y      = min(margin, height)
        return x, y, max(width - margin - x, 0), max(height - margin - y, 0)

    def check(self, disparity_px: NDArray[np.float32]) -> None:
        """Check that a map (float32, H x W, pixels, nan where there is no disparity) can come from this range.

        Raises
        ------
        ImageError
            It has disparities outside of the valid region, or out of the range.
        """
        x, y, width, height = self.window(disparity_px.shape[1], disparity_px.shape[0])
        outside = np.isfinite(disparity_px)
        outside[y:y + height, x:x + width] = False
        known  = disparity_px[np.isfinite(disparity_px)]
        # The first and the last disparity of the range are whole pixels: they have no fraction outside of it.
        beyond = (known < self.min_disparity) | (known > self.max_disparity)
        if outside.any() or beyond.any():
            what = "at its border" if outside.any() else "out of range"
            raise ImageError(f"the map has disparities {what} that were not searched: give the --disparities, "
                             "--min-disparity and --block-size that it was matched with")


def read_disparity(path: Path, search: SearchRange) -> NDArray[np.float32]:
    """Read a disparity map that `match` has written, or another program in one of its formats.

    Parameters
    ----------
    path
        .npy: int16 in sixteenths of a pixel, or floating point in pixels, nan or inf where there is none. .pfm: pixels,
        inf where there is none. An image of 16 bits: 256 times the disparity, 0 where there is none.
    search
        Its `invalid` is the value without a disparity of an int16 map.

    Returns
    -------
    float32, H x W, in pixels, nan where there is no disparity.

    Raises
    ------
    ImageError
        The file is missing or has another format, or an int16 map has another value without a disparity.
    """
    suffix = path.suffix.lower()
    if suffix == ".npy":
        return _read_npy(path, search)
    if suffix == ".pfm":
        pixels = decode_pfm(read_file(path), str(path))
    else:
        image = read_image(path)
        if image.ndim != 2 or image.dtype != np.uint16:
            raise ImageError(f"{path}: is no disparity map: a .npy, a .pfm or a grey image of 16 bits is needed")
        pixels = image.astype(np.float32)/np.float32(KITTI_SCALE)
        pixels[image == 0] = np.nan
    pixels[~np.isfinite(pixels)] = np.nan
    return pixels


def _read_npy(path: Path, search: SearchRange) -> NDArray[np.float32]:
    try:
        array = np.load(io.BytesIO(read_file(path)), allow_pickle=False)
    except (ValueError, EOFError, OSError):
        raise ImageError(f"{path}: is not an array that NumPy can read") from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or not (array.dtype == np.int16 or array.dtype.kind == "f"):
        raise ImageError(f"{path}: is no disparity map: int16 in sixteenths of a pixel or floating point in pixels "
                         "is needed, one number per pixel")
    if array.dtype == np.int16:
        # No block fits into the corner, so its value means no disparity. If that is not `invalid`, all pixels with it
        # would become a wall of one depth.
        corner = int(array[0, 0]) if array.size else search.invalid
        if corner != search.invalid and corner == array.min() and corner % DISPARITY_SCALE == 0:
            raise ImageError(f"{path}: looks like a map that was matched with --min-disparity "
                             f"{corner//DISPARITY_SCALE + 1}, not {search.min_disparity}: give that")
        return disparity_pixels(array, search.invalid)
    pixels = array.astype(np.float32)
    pixels[~np.isfinite(pixels)] = np.nan
    return pixels
