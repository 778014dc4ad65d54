#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The regions of Middlebury: all pixels, those that both cameras see, and those near depth discontinuities."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

#: Names of the regions, in the order of the tables.
REGIONS = ("all", "nonocc", "disc")

#: A step is a difference above this between neighbours; pixels in a square of that side around it are near. Both in
#: pixels, by D. Scharstein and R. Szeliski, A taxonomy and evaluation of dense two-frame stereo correspondence
#: algorithms, IJCV 47, 2002. The masks that came with Teddy and Cones later are wider.
_STEP_PX = 2.0
_NEAR_PX = 9

#: Largest difference of the truths of left and right for the same point in space, in pixels.
_AGREE_PX = 1.0


def visible_in_both(left_truth: NDArray[np.float32], right_truth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Find the pixels of the left image that the right camera sees, from the two truths.

    Parameters
    ----------
    left_truth, right_truth
        True disparities of both images: float32, H x W, in pixels, nan where they are unknown.

    Returns
    -------
    bool, H x W: true where the pixel of the right image at the left truth has the same truth, within a pixel.
    """
    height, width = left_truth.shape
    known         = np.isfinite(left_truth)
    columns       = np.rint(np.arange(width) - np.where(known, left_truth, 0.0)).astype(np.int64)
    inside        = known & (columns >= 0) & (columns < width)
    seen          = right_truth[np.arange(height)[:, np.newaxis], columns.clip(0, width - 1)]
    return np.asarray(inside & (np.abs(seen - left_truth) <= _AGREE_PX))  # Comparing nan is false.


def near_steps(truth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Find the pixels near a step: within 4 rows and columns of a pixel whose neighbour differs by more than 2 pixels.

    Parameters
    ----------
    truth
        True disparities: float32, H x W, in pixels, nan where they are unknown. An unknown pixel makes no step.

    Returns
    -------
    bool, H x W.
    """
    steps = np.zeros(truth.shape, np.uint8)
    for ahead, behind in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        step = np.abs(truth[ahead] - truth[behind]) > _STEP_PX
        steps[ahead]  |= step
        steps[behind] |= step
    return np.asarray(cv2.dilate(steps, np.ones((_NEAR_PX, _NEAR_PX), np.uint8)), bool)


def regions(truth: NDArray[np.float32], right_truth: NDArray[np.float32] | None = None,
            nonocc: NDArray[np.bool_] | None = None, disc: NDArray[np.bool_] | None = None
            ) -> dict[str, NDArray[np.bool_]]:
    """Return the regions of an image: bool, H x W, by the names in `REGIONS`.

    Parameters
    ----------
    truth
        True disparities of the left image: float32, H x W, in pixels, nan where they are unknown.
    right_truth
        Those of the right image, which give "nonocc" if `nonocc` is None; without both that region is missing.
    nonocc, disc
        Masks of the data set: bool, H x W. Without `disc` that region is what `near_steps` finds within "nonocc", or
        within all pixels if "nonocc" is missing.
    """
    found = {"all": np.isfinite(truth)}
    if nonocc is None and right_truth is not None:
        nonocc = visible_in_both(truth, right_truth)
    if nonocc is not None:
        found["nonocc"] = nonocc & found["all"]
    found["disc"] = found["all"] & disc if disc is not None else near_steps(truth) & found.get("nonocc", found["all"])
    return found
