#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reads disparity maps from files, and checks them against the range that was searched."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError, SettingsError
from ..core.settings import DISPARITY_SCALE
from ..data.map_files import read_map


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
    """Read a disparity map that `match` has written, or another program: see `data.map_files`.

    Parameters
    ----------
    path
        .npy, .npz, .pfm, or an image.
    search
        Its smallest disparity says which values mean none.

    Returns
    -------
    float32, H x W, in pixels, nan where there is no disparity.

    Raises
    ------
    ImageError
        The file is missing or has another format, or it is not certain what its values mean.
    """
    return read_map(path, search.min_disparity).pixels
