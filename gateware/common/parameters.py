#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a matcher is built for: its build-time parameters, checked, and the widths that follow from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from migen import bits_for

from .features import FEATURE_TABLE, FEATURES, PERIPHERAL_FEATURES
from .settings import MAX_HEIGHT, MAX_WIDTH, setting

# Limits -------------------------------------------------------------------------------------------

PIXEL_BITS            = 8   # Grey value of a rectified camera image.
MIN_DISPARITIES       = setting("disparities").least # Also their step, as in cv2.StereoBM.
MAX_DISPARITIES       = 128
MIN_BLOCK_SIZE        = setting("block_size").least # Below that the delay lines would be shorter than their pipeline.
MAX_BLOCK_SIZE        = 31
MAX_MIN_DISPARITY     = setting("min_disparity").most
MAX_PREFILTER_CAP     = setting("prefilter_cap").most
DEFAULT_PREFILTER_CAP = setting("prefilter_cap").default
MAX_UNIQUENESS_RATIO  = setting("uniqueness_ratio").most
MAX_DISP12_MAX_DIFF   = setting("disp12_max_diff").most
TEXTURE_BITS          = setting("texture_threshold").bits

# Features -----------------------------------------------------------------------------------------

# All stages but the median, which cv2.StereoBM does not have either.
OPENCV_FEATURES = tuple(name for name in FEATURES if name != "median")

# What cv2.StereoBM does with its prefilter XSOBEL, the one that is built.
STEREO_BM_FEATURES = tuple(name for name in OPENCV_FEATURES if name != "raw")

# Parameters ---------------------------------------------------------------------------------------

def check(condition, message):
    """Raise ValueError with `message` unless `condition`: for parameters, so that it survives `python -O`."""
    if not condition:
        raise ValueError(message)

@dataclass(frozen=True)
class MatcherParameters:
    """Build-time parameters of a matcher.

    Parameters
    ----------
    max_width : int
        Widest frame in pixels, up to 4096.
    max_height : int
        Highest frame in pixels, up to 4095. Costs only counter bits.
    disparities : int
        Largest number of disparities, a multiple of 16 from 16 to 128.
    max_block_size : int
        Largest side of the block, odd, from 5 to 31.
    features : iterable of str
        Optional stages that are built, some of `FEATURES`; "xsobel", "raw" (grey values as they are) or both.
    max_prefilter_cap : int
        Largest cap of the prefilter, from the default, 31, to 63. With 36 and blocks of 7, sums of a column have 9 bits
        instead of 10, and those of a block 12 instead of 13.
    rectification_rows : int
        Rows of the rings of the rectification: see `RectifierParameters`.
    rectification_height : int
        Highest frame in pixels that can be rectified. Costs block RAM for its nodes.
    """
    max_width:            int = 640
    max_height:           int = MAX_HEIGHT
    disparities:          int = 64
    max_block_size:       int = 9
    features:             Iterable[str] = FEATURES
    max_prefilter_cap:    int = MAX_PREFILTER_CAP
    rectification_rows:   int = 64
    rectification_height: int = 480

    def __post_init__(self):
        object.__setattr__(self, "features", frozenset(self.features))
        smallest = self.disparities + self.max_block_size
        check(self.disparities % MIN_DISPARITIES == 0 and MIN_DISPARITIES <= self.disparities <= MAX_DISPARITIES,
            f"disparities must be a multiple of {MIN_DISPARITIES} from {MIN_DISPARITIES} to {MAX_DISPARITIES}, "
            f"not {self.disparities}.")
        check(self.max_block_size % 2 == 1 and MIN_BLOCK_SIZE <= self.max_block_size <= MAX_BLOCK_SIZE,
            f"max_block_size must be odd and from {MIN_BLOCK_SIZE} to {MAX_BLOCK_SIZE}, not {self.max_block_size}.")
        check(smallest <= self.max_width <= MAX_WIDTH,
            f"max_width must be from disparities + max_block_size ({smallest}) to {MAX_WIDTH}, not {self.max_width}.")
        check(self.max_block_size <= self.max_height <= MAX_HEIGHT,
            f"max_height must be from max_block_size ({self.max_block_size}) to {MAX_HEIGHT}, not {self.max_height}.")
        check(DEFAULT_PREFILTER_CAP <= self.max_prefilter_cap <= MAX_PREFILTER_CAP,
            f"max_prefilter_cap must be from {DEFAULT_PREFILTER_CAP} to {MAX_PREFILTER_CAP}, "
            f"not {self.max_prefilter_cap}.")
        legal   = (*FEATURES, *PERIPHERAL_FEATURES)
        unknown = sorted(self.features - set(legal))
        check(not unknown, f"features must be some of {', '.join(legal)}, not {', '.join(unknown)}.")
        check(self.features & {"xsobel", "raw"}, "features must contain xsobel, raw or both.")
        check("xsobel" in self.features or "texture" not in self.features, "texture needs the feature xsobel.")

    @property
    def feature_bits(self):
        """The capability register `features`."""
        return sum(1 << one.bit for one in FEATURE_TABLE if one.name in self.features)

    @property
    def ahead(self):
        """Rows and columns that the raster runs ahead of the filtered image: the reach of the prefilter."""
        return 1 if "xsobel" in self.features else 0

    @property
    def lanes(self):
        """Sums that are taken over each block: a cost per disparity, and the texture behind them."""
        return self.disparities + ("texture" in self.features)

    @property
    def outer(self):
        """Most columns beyond each side of the valid region that get a cost, for the left-right check."""
        return self.max_block_size//2 if "left_right" in self.features else 0

    @property
    def max_slots(self):
        """Most steps of the raster in a row."""
        return self.max_width + self.ahead + 2*self.outer

    @property
    def cost_columns(self):
        """Most columns that get a cost in a row."""
        return self.max_width - MIN_DISPARITIES + 1 + 2*self.outer

    @property
    def largest_pixel(self):
        """Largest value of a pixel behind the prefilter."""
        return 2**PIXEL_BITS - 1 if "raw" in self.features else 2*self.max_prefilter_cap

    @property
    def filtered_bits(self):
        """Bits of a pixel behind the prefilter."""
        return bits_for(self.largest_pixel)

    @property
    def column_bits(self):
        """Bits of the sum of one block column's absolute differences."""
        return bits_for(self.max_block_size*self.largest_pixel)

    @property
    def cost_bits(self):
        """Bits of the cost of a whole block. Its largest value is never all ones: that marks a lane out of use."""
        return bits_for(self.max_block_size**2*self.largest_pixel)

    @property
    def index_bits(self):
        """Bits of the number of a disparity."""
        return bits_for(self.disparities - 1)
