#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference model, Verilator co-simulation of the cores, and the full system in litex_sim."""
