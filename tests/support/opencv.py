#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`cv2.StereoBM` as the reference."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from litestereo.sim.models.settings import Settings
from litestereo.sim.models.stereo_bm import invalid_value, used_columns


def opencv_map(left: NDArray[np.uint8], right: NDArray[np.uint8],
               settings: Settings) -> NDArray[np.int16]:
    """Return OpenCV's disparity map; settings that it lacks are ignored."""
    matcher = cv2.StereoBM_create(settings.disparities, settings.block_size)
    matcher.setMinDisparity(settings.min_disparity)
    matcher.setPreFilterCap(settings.prefilter_cap)
    matcher.setTextureThreshold(settings.texture_threshold)
    matcher.setUniquenessRatio(settings.uniqueness_ratio)
    matcher.setDisp12MaxDiff(settings.disp12_max_diff)
    return np.asarray(matcher.compute(left, right), np.int16)


def defined_region(shape: tuple[int, int], settings: Settings) -> tuple[slice, slice]:
    """Return rows and columns of an H x W map to which OpenCV 5.0.0 assigns a value."""
    height, width = shape
    columns       = used_columns(width, settings)
    if columns.first >= width or columns.right_first >= width or columns.count < 1:
        return slice(height), slice(width)  # There is nothing to match: all pixels are invalid.
    if columns.valid.start >= columns.valid.stop:
        return slice(0), slice(0)           # Uninitialized memory.
    if settings.min_disparity > 0:
        # OpenCV writes beyond the end of a row, into the next row.
        margin = settings.block_size // 2
        return slice(margin, height - margin), columns.valid
    return slice(height), slice(width)


def same_as_opencv(disparity: NDArray[np.int16], left: NDArray[np.uint8], right: NDArray[np.uint8],
                   settings: Settings) -> None:
    """Assert that a map equals OpenCV's on every pixel that OpenCV defines, and is invalid on the others."""
    expected = np.full(left.shape, invalid_value(settings), np.int16)
    region   = defined_region((left.shape[0], left.shape[1]), settings)
    expected[region] = opencv_map(left, right, settings)[region]
    wrong    = np.argwhere(disparity != expected)
    assert len(wrong) == 0, f"{len(wrong)} pixels differ, the first at {wrong[0].tolist()}: {settings}"
