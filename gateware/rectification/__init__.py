#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification: raw pixel pairs in, rectified ones out, bit for bit as cv2.remap with fixed-point maps."""
