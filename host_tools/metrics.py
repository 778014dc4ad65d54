#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Quality of a disparity map against the true disparities."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ImageError
from .images import INVALID, disparity_pixels


@dataclass(frozen=True)
class Quality:
    """How good a map is.

    Known pixels are those whose true disparity is known; rated pixels are the known ones for which the map
    has a disparity. A pixel without a disparity is not counted as bad: it lowers the density instead, so
    read both.

    Parameters
    ----------
    bad_1_0, bad_2_0
        Share of the rated pixels whose disparity is more than 1.0, or 2.0, pixels off, in percent.
    mean_error
        Mean of the absolute error over the rated pixels, in pixels.
    density
        Share of the known pixels that are rated, in percent.
    known_pixels, rated_pixels
        Their numbers. Without any the values above are nan.
    """

    bad_1_0:      float
    bad_2_0:      float
    mean_error:   float
    density:      float
    known_pixels: int
    rated_pixels: int


def rate(disparity: NDArray[np.int16], truth: NDArray[np.float32], invalid: int = INVALID) -> Quality:
    """Quality of a map.

    Parameters
    ----------
    disparity
        int16, H x W, in sixteenths of a pixel.
    truth
        float32, H x W, in pixels, nan where it is unknown.
    invalid
        Value of a pixel without a disparity: that and less counts as none.

    Raises
    ------
    ImageError
        The shapes differ.
    """
    if disparity.shape != truth.shape:
        raise ImageError(f"the ground truth is {truth.shape[1]}x{truth.shape[0]} pixels, "
                         f"the disparity map {disparity.shape[1]}x{disparity.shape[0]}")
    known  = np.isfinite(truth)
    pixels = disparity_pixels(disparity, invalid).astype(np.float64)
    errors = np.abs(pixels - truth)[known & (disparity > invalid)]
    return Quality(
        bad_1_0      = _mean(100.0*(errors > 1.0)),
        bad_2_0      = _mean(100.0*(errors > 2.0)),
        mean_error   = _mean(errors),
        density      = 100.0*errors.size/int(known.sum()) if known.any() else math.nan,
        known_pixels = int(known.sum()),
        rated_pixels = errors.size,
    )


def _mean(values: NDArray[np.floating[Any]]) -> float:
    return float(values.mean()) if values.size else math.nan
