#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Quality of a disparity map against the true disparities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.images import INVALID, disparity_pixels
from .metrics import measure


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
    values = measure(disparity_pixels(disparity, invalid), truth)
    return Quality(
        bad_1_0      = values["bad_of_valid_1_0"],
        bad_2_0      = values["bad_of_valid_2_0"],
        mean_error   = values["avgerr"],
        density      = values["density"],
        known_pixels = int(values["known_pixels"]),
        rated_pixels = int(values["valid_pixels"]),
    )
