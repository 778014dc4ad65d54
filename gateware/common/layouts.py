#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Layouts of the endpoints between memory, matcher and map, and the format of a disparity."""

from migen import bits_for

from .parameters import PIXEL_BITS

# Number Formats -----------------------------------------------------------------------------------

DISPARITY_BITS  = 16 # Disparity in the map, two's complement, sixteenths of a pixel.
DISPARITY_SHIFT = 4  # Fractional bits of that.

# Layouts ------------------------------------------------------------------------------------------

def pixel_pair_layout(bits=PIXEL_BITS):
    """Return left and right pixel of one row and column; in raster order, `first` and `last` mark the frame."""
    return [("left", bits), ("right", bits)]

def old_pair_layout(bits):
    """Return a pixel pair, and the one block_size rows above it, which leaves the block."""
    return pixel_pair_layout(bits) + [("left_old", bits), ("right_old", bits)]

def disparity_layout():
    """Return one pixel of the disparity map; in raster order, `first` and `last` mark the frame."""
    return [("disparity", DISPARITY_BITS)]

def winner_layout(parameters):
    """Return a disparity of the valid region, relative to the smallest one that is searched."""
    return [
        ("found",     1),                                                         # There is one.
        ("disparity", bits_for((parameters.disparities - 1) << DISPARITY_SHIFT)), # Sixteenths of a pixel.
        ("cost",      parameters.cost_bits),                                      # Its cost.
    ]
