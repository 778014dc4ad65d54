#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Measures the full system in litex_sim: `python -m litestereo.sim.bench`."""
