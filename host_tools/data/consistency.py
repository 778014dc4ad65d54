#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a pair of images says about its disparities: their scale, and whether their rows are upside down.

With the true disparities the right image, shifted by them, is the left one. With another scale it is not, unless the
images have no texture: then nothing is certain.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Scales of the usual data sets, and of maps in sixteenths and in 256ths.
SCALES = (1.0, 2.0, 3.0, 4.0, 8.0, 16.0, 256.0)

#: The best guess is certain if its difference of the images is below this share of that of any other.
_CERTAIN = 0.5

#: Least share of the known pixels that have a partner inside of the right image.
_INSIDE = 0.25

#: Least number of pixels that a guess is based on.
_MIN_PIXELS = 200

#: About as many pixels are compared.
_PIXELS = 1 << 17

#: Disparities that two guesses must differ by, in pixels, in the mean.
_APART_PX = 1.0


def difference(left: NDArray[np.uint8], right: NDArray[np.uint8], disparity_px: NDArray[np.float32]) -> float:
    """Return the mean difference of the left image and the right one, shifted by disparities.

    Parameters
    ----------
    left, right
        uint8, H x W.
    disparity_px
        float32, H x W, in pixels, nan where it is unknown.

    Returns
    -------
    In grey levels; inf if too few pixels have a partner in the right image.
    """
    known         = np.isfinite(disparity_px)
    rows, columns = np.nonzero(known)
    there         = columns - np.rint(disparity_px[known]).clip(-1e6, 1e6).astype(np.int64)
    inside        = (there >= 0) & (there < left.shape[1])
    if inside.sum() < max(_MIN_PIXELS, _INSIDE*len(rows)):
        return float("inf")
    rows, columns, there = rows[inside], columns[inside], there[inside]
    return float(np.abs(left[rows, columns].astype(np.int16) - right[rows, there]).mean())


def agreeing_scale(left: NDArray[np.uint8], right: NDArray[np.uint8], values: NDArray[np.float32],
                   scales: Sequence[float] = SCALES) -> float | None:
    """Return the scale that a pair agrees with: the divisor from values to pixels.

    Parameters
    ----------
    left, right
        uint8, H x W.
    values
        float32, H x W, nan where they are unknown.
    scales
        Divisors to choose from.

    Returns
    -------
    None if it is not certain.
    """
    step    = max(1, values.size//_PIXELS)
    some    = (left[::step], right[::step], values[::step])
    found   = sorted((difference(*some[:2], some[2]/np.float32(scale)), scale) for scale in scales)
    best    = found[0]
    # Scales that shift the images by less than a pixel are not told apart.
    size    = float(np.nanmean(np.abs(some[2]))) if np.isfinite(some[2]).any() else 0.0
    others  = [other for other in found[1:] if abs(size/other[1] - size/best[1]) >= _APART_PX]
    certain = len(others) == len(found) - 1 or best[0] < _CERTAIN*min(other[0] for other in found[1:])
    return best[1] if certain and others and best[0] < _CERTAIN*others[0][0] else None


def is_upside_down(left: NDArray[np.uint8], right: NDArray[np.uint8], disparity_px: NDArray[np.float32]) -> bool:
    """Return whether a pair agrees with the disparities only if their rows are in the other order."""
    return difference(left, right, disparity_px[::-1]) < _CERTAIN*difference(left, right, disparity_px)
