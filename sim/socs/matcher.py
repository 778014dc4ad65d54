#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parameters of the matcher in the simulated SoCs."""

from ...gateware.common.parameters import MatcherParameters

#: Large enough for every image of the Middlebury sets of 2001 and 2003.
MATCHER = MatcherParameters(max_width=640, disparities=64, max_block_size=15)
