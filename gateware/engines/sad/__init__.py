#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Block matching: sums of absolute differences, one lane per disparity."""
