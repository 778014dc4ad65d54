#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""True disparities as an array."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import decode_pfm
from .map_files import read_truth

__all__ = ["decode_pfm", "read_ground_truth"]


def read_ground_truth(path: Path, scale: float | None = None) -> NDArray[np.float32]:
    """Read true disparities from a file.

    Parameters
    ----------
    path
        A grey image of 8 or 16 bits, a PFM, or an array in .npy or .npz (its only one).
    scale
        Divisor from the file's values to pixels, above 0. None is 256 for images of 16 bits, 16 for int16, 1 for 8
        bits and floating point; other whole numbers need it.

    Returns
    -------
    float32, H x W, in pixels, nan where the disparity is unknown: 0 or less, infinite or nan in the file.

    Raises
    ------
    ImageError
        The file is missing or has another format, its scale is not known, or the scale is not above 0.
    """
    return read_truth(path, scale, "the scale").pixels
