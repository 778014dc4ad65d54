#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The grids of a pair of cameras: what they need of a device, and how near they are to the cameras' maps."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import GeometryError
from ..core.grid import LEAD, GridError, GridPair, RowBudget, fit_grid, grid_crc, grid_error, row_budget
from ..core.settings_table import MAX_HEIGHT
from .float_maps import FloatMaps, shows_all

#: Largest distance in pixels between the map of a grid and that of the cameras, and largest root of its mean square.
#: Above these the cameras' map bends too much between two nodes, and each pixel gets its own position.
MOST_ERROR_PX = 0.25
MOST_RMS_PX   = 0.05


@dataclass(frozen=True, eq=False)
class PairGrids:
    """The grids of both cameras, and what a device must hold to rectify with them."""

    grids: GridPair

    @functools.cached_property
    def crc(self) -> int:
        """The CRC-32 of the nodes, which names the grids."""
        return grid_crc(self.grids)

    @functools.cached_property
    def budget(self) -> RowBudget:
        """The rows that a device must hold."""
        return row_budget(self.grids)

    @property
    def rows(self) -> int:
        """The rows that a device must hold with a lead of two, as cameras want it."""
        return self.budget.rows(LEAD)

    @property
    def delay_rows(self) -> int:
        """The rows that come in before the first rectified row leaves, at most."""
        return max(self.budget.delay, 0)


@dataclass(frozen=True, eq=False)
class FittedGrids(PairGrids):
    """Grids, and their distance from the maps of the cameras: the larger maximum, and the rms of both."""

    error: GridError


def fit_pair(maps: Sequence[FloatMaps]) -> FittedGrids:
    """Return the grids that are nearest to the maps of a left and a right camera.

    Raises
    ------
    GeometryError
        A device cannot hold such a map: the images are too large, parts of a map are missing, it moves pixels too far,
        it folds over, or it bends too much.
    """
    height, width = maps[0][0].shape
    if max(width, height) > MAX_HEIGHT:
        raise GeometryError(f"images of {width}x{height} pixels are larger than those of any device, {MAX_HEIGHT}")
    for side, one in zip(("left", "right"), maps, strict=True):
        if not shows_all(one):
            raise GeometryError(f"parts of the rectified image are outside of what the {side} lens can show")
    left, right = (fit_grid(one) for one in maps)
    errors      = [grid_error(grid, one) for grid, one in zip((left, right), maps, strict=True)]
    error       = GridError(max(one.max_px for one in errors),
                            float(np.sqrt(np.mean([one.rms_px**2 for one in errors]))))
    if error.max_px > MOST_ERROR_PX or error.rms_px > MOST_RMS_PX:
        raise GeometryError(f"between nodes 16 pixels apart the rectification bends by {error.max_px:.2f} pixels, "
                            f"{error.rms_px:.3f} rms, at most {MOST_ERROR_PX:g} and {MOST_RMS_PX:g} are accepted")
    return FittedGrids((left, right), error)
