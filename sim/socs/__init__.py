#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SoCs that run in litex_sim, and models of what is around them: PHYs, flash, screen."""
