#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How good disparity maps are: data sets with true disparities, matchers side by side, and their metrics."""
