#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parameters of the matcher."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .errors import SettingsError
from .protocol import Parameter

#: A number of disparities is a multiple of this.
DISPARITY_STEP = 16

MIN_BLOCK_SIZE = 5

#: What is matched with unless somebody asks for something else, or the device has less.
DEFAULT_DISPARITIES = 64
DEFAULT_BLOCK_SIZE  = 9


@dataclass(frozen=True)
class MatcherSettings:
    """Parameters that a frame is matched with.

    Parameters
    ----------
    disparities
        Number of disparities searched, 0 to `disparities` - 1 pixels: a multiple of 16.
    block_size
        Side of the block in pixels: odd, at least 5.

    Raises
    ------
    SettingsError
        A value that no device takes.
    """

    disparities: int = DEFAULT_DISPARITIES
    block_size:  int = DEFAULT_BLOCK_SIZE

    def __post_init__(self) -> None:
        if self.disparities < DISPARITY_STEP or self.disparities % DISPARITY_STEP:
            raise SettingsError(f"the number of disparities must be a multiple of {DISPARITY_STEP}, from "
                                f"{DISPARITY_STEP} on, not {self.disparities}")
        if self.block_size < MIN_BLOCK_SIZE or self.block_size % 2 == 0:
            raise SettingsError(f"the block size must be an odd number, from {MIN_BLOCK_SIZE} on, "
                                f"not {self.block_size}")

    @property
    def parameters(self) -> Mapping[Parameter, int]:
        """The settings as parameters of the link protocol."""
        return {Parameter.DISPARITIES: self.disparities, Parameter.BLOCK_SIZE: self.block_size}

    @property
    def minimum_size(self) -> tuple[int, int]:
        """Width and height in pixels of the smallest image that has one pixel with a disparity."""
        return self.disparities + self.block_size - 1, self.block_size
