#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The full system in simulation: SoC, firmware and links, as a process of its own."""
