#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Cameras: the signals of image sensors in, whole frames out; triggers, stamps and skew of two sensors."""
