#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Writes depth and clouds of matched pairs to files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import Rectifier
from ..core.images import disparity_pixels, read_colour
from ..core.outputs import write_file
from ..core.settings import MatcherSettings
from . import files


def write_depth(path: Path, depth_m: NDArray[np.float32]) -> None:
    """Write a depth (float32, H x W, metres) as .npy; raise ImageError if it cannot be written."""
    write_file(path, files.depth_npy(depth_m))


def write_cloud(path: Path, rectifier: Rectifier, left: Path, disparity: NDArray[np.int16],
                settings: MatcherSettings) -> None:
    """Write the points of a map of the rectified pair as PLY.

    Parameters
    ----------
    left
        File of the left image before rectification, for the points' colours.
    disparity, settings
        int16, H x W, sixteenths of a pixel, and the settings that it was matched with.

    Raises
    ------
    ImageError
        The image cannot be read, or the file cannot be written.
    """
    image  = read_colour(left)
    points = rectifier.geometry.points_m(disparity_pixels(disparity, settings.invalid))
    write_file(path, files.ply(points, rectifier.rectify(image, image)[0]))
