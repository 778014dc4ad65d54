#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parameters of the matcher in the simulated SoCs."""

from dataclasses import replace

from ...gateware.common.parameters import FEATURES, MatcherParameters

#: Large enough for every image of the Middlebury sets of 2001 and 2003.
MATCHER = MatcherParameters(max_width=640, disparities=64, max_block_size=15)

#: Small, with a rectification that keeps 96 rows.
RECTIFYING_MATCHER = MatcherParameters(max_width=128, disparities=16, max_block_size=9,
                                       features=(*FEATURES, "rectification"), rectification_rows=96,
                                       rectification_height=128)

#: The same, with cameras.
CAMERA_MATCHER = replace(RECTIFYING_MATCHER, features=(*FEATURES, "rectification", "cameras"))
