#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From a board's name to its bitstream: sources, synthesis, place and route, checks, loader."""
