#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common import *

# Frame Settings -----------------------------------------------------------------------------------

NO_CHECK = 255 # As disp12_max_diff: no left-right check.

# Settings that are a bit each of the register `options`, from bit 0 up.
OPTIONS = ("xsobel", "subpixel", "median", "streamed")

def frame_settings():
    """Settings of a frame, as the registers hold them: (name, bits)."""
    return [
        ("left_base",         32), # Byte address of the left image.
        ("right_base",        32), # Byte address of the right image.
        ("disparity_base",    32), # Byte address of the map.
        ("width",             16), # Columns.
        ("height",            16), # Rows.
        ("disparities",        9), # Disparities to search.
        ("block_size",         6), # Side of the block.
        ("min_disparity",      bits_for(MAX_MIN_DISPARITY)),
        ("prefilter_cap",      bits_for(MAX_PREFILTER_CAP)),
        ("texture_threshold",  TEXTURE_BITS),
        ("uniqueness_ratio",   bits_for(MAX_UNIQUENESS_RATIO)),
        ("disp12_max_diff",    bits_for(NO_CHECK)),
    ] + [(name, 1) for name in OPTIONS]

class FrameSettings(LiteXModule):
    """The settings of the frame under way, and whether they are legal.

    Settings are legal if they are in their range, the image is large enough for them, the bases are aligned, and
    every stage that they use is built. After a reset all are 0, which is not legal.
    """
    def __init__(self, parameters, alignment):
        for name, bits in frame_settings():
            setattr(self, name, Signal(bits, name=name))
        self.left_right = Signal() # There is a left-right check.
        self.legal      = Signal() # Some clocks after the settings.

        # # #

        # Smallest width, registered: a sum of three in front of a comparison would be slow.
        # -----------------------------------------------------------------------------------
        range_end = Signal(10)
        min_width = Signal(11)
        self.sync += [
            range_end.eq(self.min_disparity + self.disparities),
            min_width.eq(range_end + self.block_size - 1),
        ]

        # Sizes and addresses.
        # --------------------
        low_bits = log2_int(alignment)
        rules    = [
            self.width  <= parameters.max_width,
            self.width  >= min_width,
            self.height <= parameters.max_height,
            self.height >= self.block_size,
            self.disparities[:log2_int(MIN_DISPARITIES)] == 0,
            self.disparities != 0,
            self.disparities <= parameters.disparities,
            self.block_size[0],
            self.block_size >= MIN_BLOCK_SIZE,
            self.block_size <= parameters.max_block_size,
            self.uniqueness_ratio <= MAX_UNIQUENESS_RATIO,
            ~self.xsobel | (self.prefilter_cap != 0),
        ] + [base[:low_bits] == 0 for base in (self.left_base, self.right_base, self.disparity_base)]

        # Stages that are not built.
        # --------------------------
        self.comb += self.left_right.eq(self.disp12_max_diff != NO_CHECK)
        without = {
            "xsobel":        ~self.xsobel,
            "raw":           self.xsobel,
            "texture":       ~self.xsobel | (self.texture_threshold == 0),
            "uniqueness":    self.uniqueness_ratio == 0,
            "subpixel":      ~self.subpixel,
            "left_right":    ~self.left_right,
            "min_disparity": self.min_disparity == 0,
            "median":        ~self.median,
        }
        rules += [rule for feature, rule in without.items() if feature not in parameters.features]

        kept = Signal(len(rules))
        self.sync += [bit.eq(rule) for bit, rule in zip(kept, rules)]
        self.comb += self.legal.eq(kept == 2**len(rules) - 1)
