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
from ..core.disparity_map import DisparityMap
from ..core.images import read_colour
from ..core.outputs import write_file
from . import files


def write_depth(path: Path, depth_m: NDArray[np.float32]) -> None:
    """Write a depth (float32, H x W, metres) as .npy; raise ImageError if it cannot be written."""
    write_file(path, files.depth_npy(depth_m))


def write_cloud(path: Path, rectifier: Rectifier, left: Path, map_: DisparityMap) -> None:
    """Write the points of a map of the rectified pair as PLY.

    Parameters
    ----------
    left
        File of the left image before rectification, for the points' colours.
    map_
        The map, with its cameras.

    Raises
    ------
    ImageError
        The image cannot be read, or the file cannot be written.
    """
    assert map_.geometry is not None, "a map without cameras has no points"
    image  = read_colour(left)
    points = map_.geometry.points_m(map_.pixels)
    write_file(path, files.ply(points, map_.picture(rectifier.rectify(image, image)[0])))
