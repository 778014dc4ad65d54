#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *
from litex.gen.genlib.misc import WaitTimer

from ..common                 import *
from ..common.pulse_crossing  import PulseCrossing
from ..matcher.frame_settings import frame_settings
from ..memory.port_crossing   import PortCrossing
from .stereo_csr              import PeripheralCSR
from .stereo_peripheral       import ERROR_NONE, StereoPeripheral

# Clocks of `sys` in which the settings are constant before the other side reads them. A level has crossed by then too:
# its two registers, a clock for the phase and one to spare, of a clock with a quarter of the frequency.
SETTLE_CLOCKS = (2 + 1 + 1)*4

# Stereo Peripheral Crossing -----------------------------------------------------------------------

class StereoPeripheralCrossing(PeripheralCSR, LiteXModule):
    """A `StereoPeripheral` in another clock domain, as seen from `sys`: matcher and DMA need not wait for a slow CPU.

    Ports, registers and interrupts are in `sys`, and so are all Signals, which are named as those of
    `StereoPeripheral`; clocks are counted in `sys` too. There are no streamed frames.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Ports in `sys` through which the images are read and the map is written.
    parameters : MatcherParameters
        Of the matcher: see `StereoPeripheral`.
    clock_domain : str
        Of matcher and DMA: a quarter of the frequency of `sys` at least. A reset must hold both for some clocks.
    burst_bytes, with_csr
        See `StereoPeripheral`.
    """
    def __init__(self, read_port, write_port, parameters, clock_domain, burst_bytes=128, with_csr=True):
        self.read_crossing  = PortCrossing(read_port,  "read",  clock_domain, burst_bytes)
        self.write_crossing = PortCrossing(write_port, "write", clock_domain, burst_bytes)
        self.core = core = ClockDomainsRenamer(clock_domain)(StereoPeripheral(self.read_crossing, self.write_crossing,
            parameters, burst_bytes, with_csr=False))

        self.parameters = parameters
        self.alignment  = core.alignment # Bytes.

        for name, bits in frame_settings():
            setattr(self, name, Signal(bits, name=name))
        self.start            = Signal()   # Begin a frame (pulse). Ignored while busy.
        self.abort            = Signal()   # Give the frame up (pulse). Ignored while idle.
        self.busy             = Signal()   # Between start and done or error.
        self.done             = Signal()   # The map is in memory (pulse).
        self.failed           = Signal()   # There will be no map: see error_code (pulse).
        self.error_code       = Signal(4)  # Of the last frame.
        self.clocks           = Signal(32) # Of the last frame, from start to done.
        self.first_row_clocks = Signal(32) # From start to the end of the first row that has disparities.
        self.frames           = Signal(32) # Frames done since reset.

        # # #

        begin     = Signal() # A frame is accepted: its settings are taken over.
        aborted   = Signal() # The frame is to be given up, for as long as it is under way.
        started   = self.add_pulse("sys", clock_domain)
        done      = self.add_pulse(clock_domain, "sys")
        failed    = self.add_pulse(clock_domain, "sys")
        first_row = self.add_pulse(clock_domain, "sys")
        self.specials += MultiReg(aborted, core.abort, clock_domain)
        self.comb += [
            core.start.eq(started.o),
            done.i.eq(core.done),
            failed.i.eq(core.failed),
            first_row.i.eq(core.matcher.first_row),
        ]
        self.add_settings(begin)
        self.add_clocks(aborted, first_row)
        self.add_frame(begin, started, done, failed)
        if with_csr:
            self.add_csr()
            self.add_irq()

    def add_settings(self, begin):
        """Hold the settings from `begin` on: they are constant while the other side reads them."""
        for name, bits in frame_settings():
            held = Signal(bits, name=f"held_{name}")
            self.sync += If(begin, held.eq(getattr(self, name)))
            self.comb += getattr(self.core, name).eq(held)

    def add_clocks(self, aborted, first_row):
        """Count the clocks of a frame, and remember that it is to be given up."""
        self.sync += [
            If(self.busy,
                self.clocks.eq(self.clocks + 1),
                If(self.abort, aborted.eq(1))
            ).Else(
                aborted.eq(0)
            ),
            If(first_row.o,
                self.first_row_clocks.eq(self.clocks)
            ),
        ]

    def add_frame(self, begin, started, done, failed):
        """Begin a frame on the other side, and wait for its end."""
        self.settle = settle = WaitTimer(SETTLE_CLOCKS)
        self.fsm    = fsm    = FSM(reset_state="IDLE")
        self.comb += [
            self.busy.eq(~fsm.ongoing("IDLE")),
            settle.wait.eq(fsm.ongoing("SETTLE")),
        ]
        fsm.act("IDLE",
            If(self.start,
                begin.eq(1),
                NextValue(self.error_code, ERROR_NONE),
                NextValue(self.clocks, 0),
                NextValue(self.first_row_clocks, 0),
                NextState("SETTLE")
            )
        )
        fsm.act("SETTLE",
            If(settle.done,
                started.i.eq(1),
                NextState("FRAME")
            )
        )
        fsm.act("FRAME",
            If(done.o,
                self.done.eq(1),
                NextValue(self.frames, self.frames + 1),
                NextState("IDLE")
            ),
            If(failed.o,
                self.failed.eq(1),
                NextValue(self.error_code, self.core.error_code),
                NextState("IDLE")
            )
        )

    def add_pulse(self, cd_from, cd_to):
        """Return a crossing for pulses of which at most one is under way."""
        crossing = PulseCrossing(cd_from, cd_to)
        self.submodules += crossing
        return crossing
