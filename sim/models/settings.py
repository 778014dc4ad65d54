#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the models and the gateware's simulation read of the settings of a frame."""

from __future__ import annotations

from typing import Protocol


class Settings(Protocol):
    """Any object with these fields, as `MatcherSettings` of the host tools, which describes them."""

    @property
    def disparities(self) -> int:
        """Number of disparities searched, a multiple of 16."""

    @property
    def block_size(self) -> int:
        """Side of the block in pixels, odd, 5 to 255."""

    @property
    def min_disparity(self) -> int:
        """Smallest disparity searched, in pixels; the models accept negative ones."""

    @property
    def prefilter(self) -> str:
        """"xsobel", or "none" for the grey values as they are, which have no texture test."""

    @property
    def prefilter_cap(self) -> int:
        """Largest slope that the prefilter keeps, 1 to 63."""

    @property
    def texture_threshold(self) -> int:
        """Least sum of slopes in a block; 0 for no test."""

    @property
    def uniqueness_ratio(self) -> int:
        """How much more any other disparity must cost, in percent; 0 for no test."""

    @property
    def disp12_max_diff(self) -> int:
        """Largest difference in the left-right check, in pixels; negative for no check."""

    @property
    def subpixel(self) -> bool:
        """Whether the map has fractions of a pixel."""

    @property
    def median(self) -> bool:
        """Whether a 3x3 median is the last step."""
