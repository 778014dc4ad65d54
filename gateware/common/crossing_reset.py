#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

# Gray Pointer -------------------------------------------------------------------------------------

class GrayPointer(LiteXModule):
    """A counter that also counts in Gray code, for another clock domain to see.

    The reset of its domain leaves it alone: `CrossingReset` clears it while the other side does not use it.
    """
    def __init__(self, bits):
        self.ce       = Signal()                      # Count.
        self.clear    = Signal()                      # Begin again at 0.
        self.q_binary = Signal(bits, reset_less=True) # The number,
        self.q        = Signal(bits, reset_less=True) # and its Gray code.

        # # #

        following = Signal(bits)
        self.comb += following.eq(self.q_binary + 1)
        self.sync += [
            If(self.ce,
                self.q_binary.eq(following),
                self.q.eq(following ^ following[1:])
            ),
            If(self.clear,
                self.q_binary.eq(0),
                self.q.eq(0)
            ),
        ]

# Crossing Reset -----------------------------------------------------------------------------------

class CrossingReset(LiteXModule):
    r"""Empty crossings between two clock domains after a reset of either, at any time, also if a clock is stopped.

    A side that was reset stops, and asks the other one to stop and to clear its pointers. When that has answered, the
    side clears its own, withdraws the question, and waits until the answer is withdrawn too. No reset interrupts this:
    neither question nor answer is reset. So each side clears its pointers only while the other does not use them,
    and waits for a side whose clock is stopped: meanwhile nothing is accepted and nothing comes out.

                      ______________
        asks      ___/              \____________________    of the side that was reset
                            ______________
        answers   _________/              \______________    of the other side
                      __________________________
        blocked   ___/                          \________    of the side that was reset
                           ______________
        blocked   ________/              \_______________    of the other side

    Crossings between the same domains can share one.

    Parameters
    ----------
    *domains : str
        The two clock domains.
    """
    def __init__(self, *domains):
        self.blocked = {domain: Signal(reset=1, name=f"blocked_{domain}") for domain in domains} # Accept, show nothing.
        self.clear   = {domain: Signal(name=f"clear_{domain}")            for domain in domains} # Clear pointers.

        # # #

        asks    = {domain: Signal(reset_less=True, name=f"asks_{domain}")    for domain in domains}
        answers = {domain: Signal(reset_less=True, name=f"answers_{domain}") for domain in domains}
        for domain, other in (domains, domains[::-1]):
            wanted   = Signal(reset=1, name=f"wanted_{domain}") # Since a reset.
            asked    = Signal(name=f"asked_{domain}")           # The other side asks,
            answered = Signal(name=f"answered_{domain}")        # or answers.
            self.specials += [
                MultiReg(asks[other],    asked,    domain),
                MultiReg(answers[other], answered, domain),
            ]
            self.comb += self.clear[domain].eq(asked | answered)
            sync  = getattr(self.sync, domain)
            sync += [
                answers[domain].eq(asked),
                self.blocked[domain].eq(wanted | asks[domain] | asked | answered),
                If(asks[domain],
                    wanted.eq(0),
                    # Not before the reset has ended: until then the other side has to wait.
                    If(answered & ~wanted,
                        asks[domain].eq(0)
                    )
                ).Elif(wanted & ~answered,
                    asks[domain].eq(1)
                ),
            ]
