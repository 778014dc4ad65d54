#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

TOTAL_BITS = 16

# Event Totals -------------------------------------------------------------------------------------

@ResetInserter()
class EventTotals(LiteXModule):
    """Count events, each modulo 2**TOTAL_BITS. A total includes an event from the next clock on.

    Parameters
    ----------
    events : dict of str to Signal
        Events (pulses), by name.
    """
    def __init__(self, events):
        self.totals = {name: Signal(TOTAL_BITS, name=f"{name}_total") for name in events} # Counts, by name.

        # # #

        self.sync += [total.eq(total + events[name]) for name, total in self.totals.items()]
