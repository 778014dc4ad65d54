#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Streams shown in the viewer Rerun, and as still images."""
