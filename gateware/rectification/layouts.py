#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Layouts of the endpoints between the cores of the rectifier."""

from migen import bits_for

from ..common    import PIXEL_BITS, pixel_pair_layout
from .parameters import FRACTION_BITS, NODE_BITS

# The cameras, as fields are called.
CAMERAS = ("left", "right")

def node_layout(parameters):
    """Return a node of a grid, and where it belongs: camera (0: left), grid, number of the node in raster order."""
    return [
        ("camera", 1),
        ("grid",   1),
        ("node",   bits_for(parameters.nodes - 1)),
        ("column", NODE_BITS), # Displacement, two's complement.
        ("row",    NODE_BITS),
    ]

def source_position_layout(parameters):
    """Return where a rectified pixel is in the raw image of each camera; `first` and `last` mark the frame.

    Columns and rows are two's complement and may lie outside of the image; the fractions are of the next pixel.
    """
    fields = []
    for camera in CAMERAS:
        fields += [
            (f"{camera}_column",          parameters.position_bits),
            (f"{camera}_row",             parameters.position_bits),
            (f"{camera}_column_fraction", FRACTION_BITS),
            (f"{camera}_row_fraction",    FRACTION_BITS),
        ]
    return fields + [("folded", 1)] # The map folds over here.

def ring_position_layout(parameters):
    """Return the upper left one of 2 x 2 pixels in the ring of a camera, and which columns and rows of them count.

    A pixel that does not count, because it is outside of the image or gone, is 0.
    """
    return [
        ("track",           parameters.track_bits),    # Memory of a row in the ring.
        ("column",          parameters.position_bits), # Two's complement.
        ("columns_inside",  2),                        # Bit 0: this column, bit 1: the next one.
        ("rows_inside",     2),
        ("column_fraction", FRACTION_BITS),
        ("row_fraction",    FRACTION_BITS),
    ]

def ring_write_layout(parameters):
    """Return a raw pixel and its place in the ring."""
    return [
        ("track",  parameters.track_bits),
        ("column", bits_for(parameters.max_width - 1)),
        ("pixel",  PIXEL_BITS),
    ]

def neighbours_layout():
    """Return 2 x 2 pixels, called after row and column, and the fractions of the position between them."""
    return [(name, PIXEL_BITS) for name in ("p00", "p01", "p10", "p11")] + [
        ("column_fraction", FRACTION_BITS),
        ("row_fraction",    FRACTION_BITS),
    ]

def inside_layout():
    """Return which columns and rows of the 2 x 2 pixels of each camera's position are inside of the image."""
    return [(f"{camera}_{axis}_inside", 2) for camera in CAMERAS for axis in ("columns", "rows")]

def judged_position_layout(parameters):
    """Return a position of both cameras with the counts of complete rows that decide when it may be read."""
    return source_position_layout(parameters) + inside_layout() + [
        ("needed",     parameters.count_bits), # Before that a row is missing.
        ("left_used",  1),                     # The camera has a pixel there at all.
        ("left_gone",  parameters.count_bits), # From there on a row of it is gone.
        ("right_used", 1),
        ("right_gone", parameters.count_bits),
    ]

def pair_write_layout(parameters):
    """Return a raw pair and its place in the rings."""
    return ring_write_layout(parameters)[:2] + pixel_pair_layout()

def pair_position_layout(parameters):
    """Return a position in the ring of each camera; whether a row of it is gone, and whether the map folds over."""
    fields = [(f"{camera}_{name}", bits) for camera in CAMERAS for name, bits in ring_position_layout(parameters)]
    return fields + [(name, 1) for name in ("row_gone", "folded", "frame_first", "frame_last")]
