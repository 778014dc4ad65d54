#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rows of both cameras' images for which the builds of our boards have block RAM to spare.

No board has a rectifier yet. docs/rectification.md says how much block RAM a ring takes, and has this table.
"""

from __future__ import annotations

from dataclasses import dataclass

from .pair_grids import PairGrids

#: Fewest and most rows of a ring.
LEAST_ROWS = 24
MOST_ROWS  = 96


@dataclass(frozen=True)
class Room:
    """Widest image in pixels, block RAMs of 2048 x 8 bits to spare, and most rows of two rings of that width in these.

    `rows` is 0 if they are not enough for the fewest rows.
    """

    width:  int
    blocks: int
    rows:   int


#: Room for rectification by the name of the board.
BUILDS = {
    "colorlight_i5":   Room(640, 6, 0),
    "colorlight_i9":   Room(640, 28, 24),
    "ulx3s":           Room(640, 94, MOST_ROWS),
    "ecpix5":          Room(640, 80, MOST_ROWS),
    "tang_primer_20k": Room(512, 0, 0),
    "arty":            Room(640, 51, 64),
    "atlys":           Room(640, 46, 50),
}


def boards_with_room(grids: PairGrids) -> list[str]:
    """Return the boards whose spare block RAM is enough to rectify with the grids."""
    width, rows = grids.grids[0].width, grids.rows
    return [name for name, room in BUILDS.items() if width <= room.width and rows <= room.rows]
