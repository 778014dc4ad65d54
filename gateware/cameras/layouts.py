#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Layouts of the endpoints between the cores of the capture."""

from ..common           import PIXEL_BITS
from .parameters        import SPAN_BITS, STAMP_BITS
from .trigger_generator import NUMBER_BITS

# The sensors, in this order everywhere.
SIDES = ("left", "right")

# Kinds of Items -----------------------------------------------------------------------------------

# What a sensor sends, in the order in which it sends it.
PIXEL       = 0 # A pixel of a row.
ROW_END     = 1 # The row that is under way has ended.
FRAME_BEGIN = 2 # A frame begins; one that is under way has ended.
FRAME_END   = 3 # The frame has ended, and with it a row that is under way.

# Layouts ------------------------------------------------------------------------------------------

def sensor_layout():
    """Return an item of a sensor: its kind, and the grey value of a pixel."""
    return [("kind", 2), ("pixel", PIXEL_BITS)]

def captured_layout():
    """Return an item of a sensor after a crossing, and whether items in front of it were lost."""
    return [*sensor_layout(), ("lost", 1)]

def pixel_layout():
    """Return a pixel of one image; in raster order, `first` and `last` mark the frame."""
    return [("pixel", PIXEL_BITS)]

def pair_layout():
    """Return what is known of a pair of frames when it is found: see `PairMatcher`."""
    return [
        ("number",      NUMBER_BITS), # Its number.
        ("exposed",     STAMP_BITS),  # When its trigger began.
        ("left_stamp",  STAMP_BITS),  # When the sensors started their frames.
        ("right_stamp", STAMP_BITS),
        ("skew",        SPAN_BITS),   # Clocks from left to right start, two's complement.
        ("flagged",     1),           # They are too many.
    ]
