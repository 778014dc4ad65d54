#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of images and true disparities: data sets, files, videos and cameras."""
