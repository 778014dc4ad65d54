#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Disparity maps as other programs want them: depth, point clouds, ROS messages."""
