#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of cameras: their parameters, calibration from images of a board, and rectification."""
