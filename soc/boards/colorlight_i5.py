#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Colorlight i5: LFE5U-25F, 8 MB of SDRAM at 32 bits, gigabit Ethernet."""

from .colorlight import ColorlightSoC
from .preset     import Preset

class ColorlightI5(ColorlightSoC):
    board_name   = "colorlight_i5"
    board        = "i5"
    revision     = "7.0"
    loader       = "colorlight-i5"
    flash_offset = 1024*1024 # Of 2 MiB.
    preset       = Preset(
        disparities    = 16,
        max_block_size = 9,
        sys_clk_freq   = 60000000,
        with_icmp      = False,
    )
