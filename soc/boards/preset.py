#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The configuration of a board."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...gateware.common.parameters import STEREO_BM_FEATURES, MatcherParameters

def option(default, text):
    """Return a field with the help of its option in a target."""
    return field(default=default, metadata={"help": text})

@dataclass(frozen=True)
class Preset:
    """The configuration of a board: matcher, CPU and clock, chosen by measurement."""
    disparities:        int             = option(64, "Largest number of disparities, a multiple of 16.")
    max_block_size:     int             = option(9, "Largest block size, odd.")
    max_prefilter_cap:  int             = option(63, "Largest cap of the prefilter, from 31 on: sums have fewer bits.")
    max_width:          int             = option(640, "Widest image in pixels.")
    features:           tuple[str, ...] = option(STEREO_BM_FEATURES, "Optional stages of the matcher.")
    rectification_rows: int             = option(64, "Rows of each image that the rectification keeps, if it is built.")
    sys_clk_freq:       int             = option(60000000, "Clock of the system in Hz.")
    matcher_hz:         int             = option(0, "Clock of matcher and DMA in Hz, if it is not the system's.")
    cpu_variant:        str             = option("lite", "Variant of the VexRiscv.")
    fast_ram_bytes:     int             = option(0, "On-chip RAM for what the firmware runs often; 0 for none.")
    # Long bursts, because SDRAM changes its row after each.
    burst_bytes:        int             = option(256, "Bytes that are read or written in one go.")
    streaming:          bool            = option(True, "Match frames as they come from the wire, unstored.")
    with_icmp:          bool            = option(True, "Answer a ping.")
    with_screen:        bool            = option(False, "Show the map on a monitor, where the board has a connector.")
    seed:               int             = option(1, "Seed of nextpnr.")

    @property
    def parameters(self) -> MatcherParameters:
        """Return the build-time parameters of the matcher; raise ValueError if they cannot be built."""
        return MatcherParameters(
            max_width          = self.max_width,
            disparities        = self.disparities,
            max_block_size     = self.max_block_size,
            max_prefilter_cap  = self.max_prefilter_cap,
            features           = self.features,
            rectification_rows = self.rectification_rows,
        )

    @property
    def frames_per_second(self) -> float:
        """Return the frames of 640 x 480 per second at a pixel per clock."""
        return self.pixels_per_second/(640*480)

    @property
    def pixels_per_second(self) -> int:
        """Return the pixels per second at a pixel per clock."""
        return self.matcher_hz or self.sys_clk_freq
