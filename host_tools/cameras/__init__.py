#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Cameras: what describes a pair, its calibration from pictures of a board, and rectification."""
