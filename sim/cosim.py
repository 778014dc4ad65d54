#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher's emitted Verilog as a matcher of whole images."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gateware.matcher import Matcher
from .stream_core import StreamCore

SETTINGS = ("width", "height", "disparities", "block_size")


class CosimMatcher:
    """`Matcher` in Verilator, in this process.

    Parameters
    ----------
    max_width
        Widest image, in pixels.
    disparities
        Lanes built: the largest number of disparities, a multiple of 16.
    max_block_size
        Largest block size.

    Raises
    ------
    ValueError
        The gateware cannot be built with such parameters.
    """
    def __init__(self, max_width: int = 1024, disparities: int = 64, max_block_size: int = 21) -> None:
        self.max_width      = max_width
        self.disparities    = disparities
        self.max_block_size = max_block_size
        self.core = StreamCore(Matcher(max_width=max_width, disparities=disparities, max_block_size=max_block_size),
                                  SETTINGS)

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], disparities: int, block_size: int, *,
              valid: float = 1.0, ready: float = 1.0, seed: int = 0) -> tuple[NDArray[np.int16], int, int]:
        """Match one pair.

        Parameters
        ----------
        left, right
            Rectified 8-bit grey images, H x W.
        disparities, block_size
            Settings of the frame.
        valid, ready
            Chance, per clock, that a pixel pair is offered and that the map's next pixel is taken.
        seed
            Seeds these chances.

        Returns
        -------
        The map (int16, H x W, sixteenths of a pixel), the clocks from the first pixel in to the last one out, and
        the clocks to the end of the first row that has disparities.

        Raises
        ------
        RuntimeError
            The core stopped short of a whole map.
        """
        height, width = left.shape
        pixels        = height*width
        self.core.set(width=width, height=height, disparities=disparities, block_size=block_size)
        words  = left.astype(np.uint32).ravel() | right.astype(np.uint32).ravel() << 8
        result = self.core.run(words, pixels, valid=valid, ready=ready, seed=seed,
                               probe=(block_size//2 + 1)*width - 1)
        if len(result.words) != pixels or result.accepted != pixels:
            self.core.reset()
            raise RuntimeError(f"the matcher took {result.accepted} and gave {len(result.words)} of {pixels} pixels")
        expected = np.zeros(pixels, bool)
        expected[-1] = True
        if not np.array_equal(result.last, expected) or not np.array_equal(result.first, expected[::-1]):
            raise RuntimeError("the marks of the map's first and last pixel are wrong")
        disparity = result.words.astype(np.uint16).view(np.int16).reshape(height, width)
        return disparity, result.clocks, result.probe_clock

    def close(self) -> None:
        """Free the model."""
        self.core.close()
