#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Calibration of a pair of cameras from pictures of a board, and the rectification that comes of it."""
