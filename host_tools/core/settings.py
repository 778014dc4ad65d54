#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parameters of the matcher."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping
from dataclasses import dataclass

from .errors import SettingsError
from .features import Feature

#: A number of disparities is a multiple of this.
DISPARITY_STEP = 16

MIN_BLOCK_SIZE = 5

#: What is matched with unless somebody asks for something else, or the device has less.
DEFAULT_DISPARITIES = 64
DEFAULT_BLOCK_SIZE  = 9

#: A map counts in this fraction of a pixel.
DISPARITY_SCALE = 16

#: The prefilters, by their numbers in the link protocol.
PREFILTERS = ("none", "xsobel")

#: Least and largest value of the parameters that have a range.
RANGES = {
    "min_disparity":     (0, 255),
    "prefilter_cap":     (1, 63),
    "texture_threshold": (0, (1 << 20) - 1),
    "uniqueness_ratio":  (0, 100),
    "disp12_max_diff":   (-1, 254),
}


class Parameter(enum.IntEnum):
    """Numbers of the parameters in the link protocol."""

    DISPARITIES       = 1
    BLOCK_SIZE        = 2
    MIN_DISPARITY     = 3
    PREFILTER         = 4
    PREFILTER_CAP     = 5
    TEXTURE_THRESHOLD = 6
    UNIQUENESS_RATIO  = 7
    DISP12_MAX_DIFF   = 8
    SUBPIXEL          = 9
    MEDIAN            = 10


@dataclass(frozen=True)
class MatcherSettings:
    """Parameters that a frame is matched with: those of `cv2.StereoBM` by its names, and a few more.

    Parameters
    ----------
    disparities
        Number of disparities searched: a multiple of 16.
    block_size
        Side of the block in pixels: odd, at least 5.
    min_disparity
        Smallest disparity searched, 0 to 255 pixels.
    prefilter
        "xsobel", or "none" for the grey values as they are, which have no texture test.
    prefilter_cap
        Largest slope that the prefilter keeps, 1 to 63.
    texture_threshold
        Least sum of slopes in a block, 0 to 1048575.
    uniqueness_ratio
        By how many percent more any other disparity must cost, 0 to 100; 0 for no test.
    disp12_max_diff
        Largest difference in the left-right check, 0 to 254 pixels; -1 for no check.
    subpixel
        Whether the map has sixteenths of a pixel, or whole pixels only.
    median
        Whether a 3x3 median is the last step.

    Raises
    ------
    SettingsError
        A value that no device takes.
    """

    disparities:       int  = DEFAULT_DISPARITIES
    block_size:        int  = DEFAULT_BLOCK_SIZE
    min_disparity:     int  = 0
    prefilter:         str  = "xsobel"
    prefilter_cap:     int  = 31
    texture_threshold: int  = 10
    uniqueness_ratio:  int  = 15
    disp12_max_diff:   int  = -1
    subpixel:          bool = True
    median:            bool = False

    def __post_init__(self) -> None:
        if self.disparities < DISPARITY_STEP or self.disparities % DISPARITY_STEP:
            raise SettingsError(f"the number of disparities must be a multiple of {DISPARITY_STEP}, from "
                                f"{DISPARITY_STEP} on, not {self.disparities}")
        if self.block_size < MIN_BLOCK_SIZE or self.block_size % 2 == 0:
            raise SettingsError(f"the block size must be an odd number, from {MIN_BLOCK_SIZE} on, "
                                f"not {self.block_size}")
        if self.prefilter not in PREFILTERS:
            raise SettingsError(f"the prefilter must be one of {', '.join(PREFILTERS)}, not {self.prefilter}")
        for name, (least, most) in RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise SettingsError(f"the {name.replace('_', ' ')} must be a number from {least} to {most}, "
                                    f"not {value}")

    @property
    def parameters(self) -> Mapping[Parameter, int]:
        """The settings as parameters of the link protocol."""
        return {
            Parameter.DISPARITIES:       self.disparities,
            Parameter.BLOCK_SIZE:        self.block_size,
            Parameter.MIN_DISPARITY:     self.min_disparity,
            Parameter.PREFILTER:         PREFILTERS.index(self.prefilter),
            Parameter.PREFILTER_CAP:     self.prefilter_cap,
            Parameter.TEXTURE_THRESHOLD: self.texture_threshold if self.prefilter == "xsobel" else 0,
            Parameter.UNIQUENESS_RATIO:  self.uniqueness_ratio,
            Parameter.DISP12_MAX_DIFF:   self.disp12_max_diff,
            Parameter.SUBPIXEL:          int(self.subpixel),
            Parameter.MEDIAN:            int(self.median),
        }

    @property
    def minimum_size(self) -> tuple[int, int]:
        """Width and height in pixels of the smallest image that has one pixel with a disparity."""
        return self.min_disparity + self.disparities + self.block_size - 1, self.block_size

    @property
    def invalid(self) -> int:
        """Value of a pixel of the map that has no disparity, in sixteenths of a pixel; others are larger."""
        return (self.min_disparity - 1)*DISPARITY_SCALE

    @property
    def features(self) -> Feature:
        """Stages that a device needs for these settings."""
        needed = Feature.XSOBEL if self.prefilter == "xsobel" else Feature.RAW
        for feature, used in (
            (Feature.TEXTURE,       self.prefilter == "xsobel" and self.texture_threshold > 0),
            (Feature.UNIQUENESS,    self.uniqueness_ratio > 0),
            (Feature.SUBPIXEL,      self.subpixel),
            (Feature.LEFT_RIGHT,    self.disp12_max_diff >= 0),
            (Feature.MIN_DISPARITY, self.min_disparity > 0),
            (Feature.MEDIAN,        self.median),
        ):
            if used:
                needed |= feature
        return needed

    def without(self, missing: Feature) -> MatcherSettings:
        """The settings for a device that lacks the stages `missing`: what needs them is switched off."""
        off: dict[Feature, dict[str, int | str | bool]] = {
            Feature.XSOBEL:        {"prefilter": "none"},
            Feature.RAW:           {"prefilter": "xsobel"},
            Feature.TEXTURE:       {"texture_threshold": 0},
            Feature.UNIQUENESS:    {"uniqueness_ratio": 0},
            Feature.SUBPIXEL:      {"subpixel": False},
            Feature.LEFT_RIGHT:    {"disp12_max_diff": -1},
            Feature.MIN_DISPARITY: {"min_disparity": 0},
            Feature.MEDIAN:        {"median": False},
        }
        values = dataclasses.asdict(self)
        for feature, changes in off.items():
            if feature & self.features & missing:
                values |= changes
        return MatcherSettings(**values)
