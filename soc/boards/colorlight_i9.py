#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Colorlight i9: LFE5U-45F, 8 MB of SDRAM at 32 bits, gigabit Ethernet."""

from .colorlight import ColorlightSoC
from .preset     import Preset

class ColorlightI9(ColorlightSoC):
    board_name   = "colorlight_i9"
    board        = "i9"
    revision     = "7.2"
    loader       = "colorlight-i9"
    preset       = Preset(
        disparities    = 64,
        max_block_size = 9,
        sys_clk_freq   = 65000000,
        seed           = 3,
    )
