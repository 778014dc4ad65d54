#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Disparity maps in formats of other programs: depth, point clouds, ROS messages."""
