#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices: what matches image pairs, on the other side of a link or in this process."""
