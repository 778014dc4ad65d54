#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The full system in simulation, as a separate process: SoC, firmware and links."""
