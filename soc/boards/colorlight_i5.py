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
        disparities       = 32,
        max_block_size    = 7,
        max_prefilter_cap = 36, # One more bit in the sums would take two more of the 56 block RAMs.
        sys_clk_freq      = 60000000,
        # With streamed frames 92 % of the sites are in use, and the router does not converge.
        streaming         = False,
        with_icmp         = False,
    )
