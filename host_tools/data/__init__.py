#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs from elsewhere: data sets, ground truth, files, videos and cameras."""
