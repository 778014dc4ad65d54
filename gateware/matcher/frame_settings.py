#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common          import *
from ..common.settings import FRAME_OPTIONS, FRAME_REGISTERS, SETTINGS, setting

# Frame Settings -----------------------------------------------------------------------------------

NO_CHECK = setting("disp12_max_diff").off_in_register # No left-right check.

# Fields of the register `options`: name, bit, description.
OPTIONS = sorted([(one.option, one.option_bit, one.register_text) for one in SETTINGS if one.option] + [
    (one.name, one.bit, one.text) for one in FRAME_OPTIONS if not one.feature], key=lambda option: option[1])

# The other registers: name, bits, description.
REGISTERS = [(one.name, one.bits, one.text) for one in FRAME_REGISTERS if not one.feature] + [
    (one.name, one.bits, one.register_text) for one in SETTINGS if not one.option]

# The size for which the frame's grid was loaded: a setting that software does not write.
GRID_SIZE = [("grid_width", 16), ("grid_height", 16)]

def added_options(features):
    """Return the fields of `options` that come with features: name, bit, description."""
    return [(one.name, one.bit, one.text) for one in FRAME_OPTIONS if one.feature in features]

def added_registers(features):
    """Return the registers that come with features: name, bits, description."""
    return [(one.name, one.bits, one.text) for one in FRAME_REGISTERS if one.feature in features]

def frame_settings(features=()):
    """Return the settings of a frame, as the registers hold them: (name, bits)."""
    registers = REGISTERS + added_registers(features)
    return [(name, bits) for name, bits, _ in registers] + [
        (name, 1) for name, *_ in OPTIONS + added_options(features)] + (
        GRID_SIZE if "rectification" in features else [])

class FrameSettings(LiteXModule):
    """The settings of the frame under way, and whether they are legal.

    Settings are legal if they are in their range, the image is large enough for them, the bases are aligned, every
    stage that they use is built, and the grid of a frame to rectify was loaded for its size. After a reset all are 0,
    which is not legal.
    """
    def __init__(self, parameters, alignment):
        for name, bits in frame_settings(parameters.features):
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
            self.disparities <= parameters.disparities,
            self.block_size  <= parameters.max_block_size,
            self.unless_unused(setting("prefilter_cap"), self.prefilter_cap <= parameters.max_prefilter_cap),
        ] + [base[:low_bits] == 0 for base in (self.left_base, self.right_base, self.disparity_base)]

        # Ranges, and stages that are not built.
        # --------------------------------------
        self.comb += self.left_right.eq(self.disp12_max_diff != NO_CHECK)
        for one in SETTINGS:
            rules += self.rules_of_range(one) + self.rules_of_stages(one, parameters.features)
        if "rectification" in parameters.features:
            rules += self.rules_of_rectification(parameters.rectification_height, low_bits)

        kept = Signal(len(rules))
        self.sync += [bit.eq(rule) for bit, rule in zip(kept, rules)]
        self.comb += self.legal.eq(kept == 2**len(rules) - 1)

    def unless_unused(self, one, rule):
        """A rule that holds as well where the setting has no effect, as another one is off."""
        return self.is_off(setting(one.unused_without)) | rule if one.unused_without else rule

    def is_off(self, one):
        """Whether a setting is switched off."""
        return getattr(self, one.register) == one.off_in_register

    def rules_of_range(self, one):
        """The rules that keep a setting in its range, as far as its bits hold more than that."""
        value = getattr(self, one.register)
        rules = []
        if one.step > 1:
            rules.append(value[:log2_int(one.step)] == one.least % one.step)
        if one.off_in_register is None and one.least > 0:
            rules.append(value >= one.least)
        if one.register_off is None and not one.built and one.most < 2**one.bits - 1:
            rules.append(value <= one.most)
        return [self.unless_unused(one, rule) for rule in rules]

    def rules_of_stages(self, one, features):
        """The rules that a setting needs no stage that is not built."""
        rules = []
        if one.feature and one.feature not in features:
            rules.append(self.unless_unused(one, self.is_off(one)))
        if one.off_feature and one.off_feature not in features:
            rules.append(~self.is_off(one))
        return rules

    def rules_of_rectification(self, max_height, low_bits):
        """The rules that a frame to rectify has the size of its grid, and that the images that come out are aligned."""
        return [~self.rectified | rule for rule in (
            self.grid_width  == self.width,
            self.grid_height == self.height,
            self.height      <= max_height,
        )] + [base[:low_bits] == 0 for base in (self.left_out_base, self.right_out_base)]
