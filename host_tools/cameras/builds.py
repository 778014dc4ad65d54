#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The rectifiers of our boards, as their presets build them."""

from __future__ import annotations

from dataclasses import dataclass

from .pair_grids import PairGrids


@dataclass(frozen=True)
class Build:
    """Widest image in pixels, and rows of each image that the rectifier keeps."""

    width: int
    rows:  int


#: Rectifiers by the name of the board; the other boards have none.
BUILDS = {
    "ulx3s":  Build(640, 64),
    "ecpix5": Build(640, 64),
}


def rectifying_boards(grids: PairGrids) -> list[str]:
    """Return the boards that can rectify with the grids."""
    width, rows = grids.grids[0].width, grids.rows
    return [name for name, build in BUILDS.items() if width <= build.width and rows <= build.rows]
