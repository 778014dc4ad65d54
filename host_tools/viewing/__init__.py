#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Streams to look at: the viewer Rerun, and still montages."""
