#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a rectifier is built for: its build-time parameters, checked, and what follows from them; its number formats."""

from __future__ import annotations

from dataclasses import dataclass

from migen import bits_for

from ..common.parameters import check
from ..common.settings   import MAX_HEIGHT, MAX_WIDTH

# Number Formats -----------------------------------------------------------------------------------

FRACTION_BITS = 5  # Of a position in the raw image, per axis, as in cv2.remap.
STEP_BITS     = 4  # Nodes are 2**STEP_BITS pixels apart.
NODE_BITS     = 16 # Displacement of a node per axis, two's complement,
NODE_FRACTION = 7  # with as many fractional bits.
REACH         = 2**(NODE_BITS - 1 - NODE_FRACTION) # Pixels by which a position may be displaced.

GRIDS = 2 # One in use, one that is written.

# Limits -------------------------------------------------------------------------------------------

MIN_ROWS = 4
MAX_ROWS = 512

# Parameters ---------------------------------------------------------------------------------------

@dataclass(frozen=True)
class RectifierParameters:
    """Build-time parameters of a rectifier.

    Parameters
    ----------
    max_width, max_height : int
        Largest frame in pixels. The grids have nodes for it.
    rows : int
        Rows of the ring of each camera, even. A map needs as many as `host_tools/core/grid.py` says.
    """
    max_width:  int = 640
    max_height: int = 480
    rows:       int = 64

    def __post_init__(self):
        step = 2**STEP_BITS
        check(step < self.max_width <= MAX_WIDTH,
            f"max_width must be from {step + 1} to {MAX_WIDTH}, not {self.max_width}.")
        check(1 < self.max_height <= MAX_HEIGHT, f"max_height must be from 2 to {MAX_HEIGHT}, not {self.max_height}.")
        check(self.rows % 2 == 0 and MIN_ROWS <= self.rows <= MAX_ROWS,
            f"rows must be even and from {MIN_ROWS} to {MAX_ROWS}, not {self.rows}.")

    @property
    def node_columns(self):
        """Most columns of nodes: one more than pieces of a row."""
        return (self.max_width - 1)//2**STEP_BITS + 2

    @property
    def nodes(self):
        """Most nodes of a grid."""
        return self.node_columns*((self.max_height - 1)//2**STEP_BITS + 2)

    @property
    def bank_columns(self):
        """Pixels of a row in a bank, which has every second column."""
        return (self.max_width + 1)//2

    @property
    def bank_words(self):
        """Pixels in each of a ring's four banks."""
        return self.rows//2*self.bank_columns

    @property
    def position_bits(self):
        """Bits of a column or a row of the raw image, two's complement; positions reach beyond the image."""
        return bits_for(max(self.max_width, self.max_height) + REACH) + 1

    @property
    def track_bits(self):
        """Bits of the number of a row in the ring."""
        return bits_for(self.rows - 1)

    @property
    def count_bits(self):
        """Bits of a count of rows: those of a frame, and those of the next frame that are in the ring with them."""
        return bits_for(self.max_height + self.rows)
