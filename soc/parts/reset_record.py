#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect.csr import *

# Reset Record -------------------------------------------------------------------------------------

class ResetRecord(LiteXModule):
    """Two words that survive a reset of the SoC, in which software records the reason for the reset.

    Both are 0 after power-up. The firmware defines their meaning: see `include/litestereo/reset.h` there.
    """
    def __init__(self):
        self._cause = CSRStorage(32, reset_less=True, description="Why the SoC was reset; 0 after power-up.")
        self._place = CSRStorage(32, reset_less=True, description="Address in the program that it concerns.")
