#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the simulated SoCs build their matcher for."""

from ...gateware.common.parameters import MatcherParameters

#: Every image of the Middlebury sets of 2001 and 2003 fits.
MATCHER = MatcherParameters(max_width=640, disparities=64, max_block_size=15)
