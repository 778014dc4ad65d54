#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pair after pair: matching as pairs come, and what that measures."""
