#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the capture of a camera is built for: its build-time parameters, checked."""

from __future__ import annotations

from dataclasses import dataclass

from ..common.parameters import check
from ..common.settings   import MAX_HEIGHT, MAX_WIDTH

# Widths -------------------------------------------------------------------------------------------

STAMP_BITS = 64 # Count of clocks since power-on.
SPAN_BITS  = 32 # Clocks of a period, an exposure or a skew.

# Parameters ---------------------------------------------------------------------------------------

@dataclass(frozen=True)
class CameraParameters:
    """Build-time parameters of the capture of a camera.

    Parameters
    ----------
    max_width, max_height : int
        Largest frame in pixels.
    silence_bits : int
        Bits of the longest time without a mark of the sensor, in clocks.
    skew_pixels : int
        Pixels of a sensor that are kept while it is ahead of the other one, a power of 2: with 2048 a queue is a block
        RAM of 18 Kbit, and holds three rows of 640 pixels.
    """
    max_width:    int = 640
    max_height:   int = 480
    silence_bits: int = 24
    skew_pixels:  int = 2048

    def __post_init__(self):
        check(2 <= self.max_width <= MAX_WIDTH, f"max_width must be from 2 to {MAX_WIDTH}, not {self.max_width}.")
        check(2 <= self.max_height <= MAX_HEIGHT, f"max_height must be from 2 to {MAX_HEIGHT}, not {self.max_height}.")
        check(1 <= self.silence_bits <= SPAN_BITS,
            f"silence_bits must be from 1 to {SPAN_BITS}, not {self.silence_bits}.")
        check(16 <= self.skew_pixels <= 2**16 and self.skew_pixels & (self.skew_pixels - 1) == 0,
            f"skew_pixels must be a power of 2 from 16 to {2**16}, not {self.skew_pixels}.")
