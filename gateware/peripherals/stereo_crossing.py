#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *
from litex.gen.genlib.misc import WaitTimer

from litex.soc.interconnect import stream

from ..common                 import *
from ..common.crossing        import Crossing
from ..common.crossing_reset  import CrossingReset
from ..common.pulse_crossing  import PulseCrossing
from ..common.stream_register import add_register
from ..matcher.frame_settings import frame_settings
from ..memory.port_crossing   import PortCrossing
from ..rectification.layouts  import node_layout
from .rectification           import rectifier_parameters
from .stereo_csr              import PeripheralCSR
from .stereo_peripheral       import ERROR_NONE, StereoPeripheral

# Clocks of `sys` in which the settings are constant before the other side reads them. A level has crossed by then too:
# its two registers, a clock for the phase and one to spare, of a clock with a quarter of the frequency. A level that
# lasts as long is seen for three clocks of the other side at least.
SETTLE_CLOCKS = (2 + 1 + 1)*4

# Stereo Peripheral Crossing -----------------------------------------------------------------------

class StereoPeripheralCrossing(PeripheralCSR, LiteXModule):
    """A `StereoPeripheral` in another clock domain, as seen from `sys`: matcher and DMA need not wait for a slow CPU.

    Ports, registers and interrupts are in `sys`, and so are all Signals, which are named as those of
    `StereoPeripheral`; clocks are counted in `sys` too.

    Pairs of a streamed frame and its map cross as well. The receiver of the map never stalls; the matcher does, while
    the crossing is full. A frame ends when its map has left the crossing, and pairs that were left over are discarded.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Ports in `sys` through which the images are read and the map is written.
    parameters : MatcherParameters
        Of the matcher: see `StereoPeripheral`.
    clock_domain : str
        Of matcher and DMA: a quarter of the frequency of `sys` at least. A reset must reach both.
    burst_bytes, with_csr, image_ports
        See `StereoPeripheral`.
    """
    def __init__(self, read_port, write_port, parameters, clock_domain, burst_bytes=128, with_csr=True,
        image_ports=()):
        self.clock_domain   = clock_domain
        self.reset          = CrossingReset("sys", clock_domain)
        self.read_crossing  = PortCrossing(read_port,  "read",  clock_domain, burst_bytes, self.reset)
        self.write_crossing = PortCrossing(write_port, "write", clock_domain, burst_bytes, self.reset)
        image_crossings = [PortCrossing(port, "write", clock_domain, burst_bytes, self.reset) for port in image_ports]
        self.submodules += image_crossings
        self.core = core = ClockDomainsRenamer(clock_domain)(StereoPeripheral(self.read_crossing, self.write_crossing,
            parameters, burst_bytes, with_csr=False, map_waits=True, image_ports=image_crossings))

        self.parameters = parameters
        self.alignment  = core.alignment # Bytes.

        self.pairs = stream.Endpoint(pixel_pair_layout()) # Pairs of a streamed frame, the first and the last marked.
        self.map   = stream.Endpoint(disparity_layout())  # Its map; the receiver never stalls.
        for name, bits in frame_settings(parameters.features):
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

        begin        = Signal() # A frame is accepted: its settings are taken over.
        self.aborted = Signal() # The frame is to be given up, for as long as it is under way.
        started   = self.add_pulse("sys", clock_domain)
        done      = self.add_pulse(clock_domain, "sys")
        failed    = self.add_pulse(clock_domain, "sys")
        first_row = self.add_pulse(clock_domain, "sys")
        self.specials += MultiReg(self.aborted, core.abort, clock_domain)
        self.comb += [
            core.start.eq(started.o),
            first_row.i.eq(core.matcher.first_row),
        ]
        self.add_settings(begin)
        self.add_clocks(first_row)
        self.add_frame(begin, started, done, failed)
        self.add_pairs(begin)
        self.add_map()
        self.add_end(done, failed)
        if image_ports:
            self.add_rectification(begin)
        if with_csr:
            self.add_csr()
            self.add_irq()

    def takes_pairs(self):
        """Return whether a streamed frame is under way, whose pairs it takes or has taken: an expression in `sys`."""
        return self.busy & self.core.streamed

    def add_settings(self, begin):
        """Hold the settings from `begin` on: they are constant while the other side reads them."""
        for name, bits in frame_settings(self.parameters.features):
            held = Signal(bits, name=f"held_{name}")
            self.sync += If(begin, held.eq(getattr(self, name)))
            self.comb += getattr(self.core, name).eq(held)

    def add_clocks(self, first_row):
        """Count the clocks of a frame, and remember that it is to be given up."""
        self.sync += [
            If(self.busy,
                self.clocks.eq(self.clocks + 1),
                If(self.abort, self.aborted.eq(1))
            ).Else(
                self.aborted.eq(0)
            ),
            If(first_row.o,
                self.first_row_clocks.eq(self.clocks)
            ),
        ]

    def add_frame(self, begin, started, done, failed):
        """Begin a frame on the other side, and wait for its end."""
        self.settle = settle = WaitTimer(SETTLE_CLOCKS)
        self.fsm    = fsm    = FSM(reset_state="IDLE")
        good        = Signal() # The map is in memory.
        self.pairs_empty = Signal() # No pair is in the crossing.
        self.comb += [
            self.busy.eq(~fsm.ongoing("IDLE")),
            settle.wait.eq(fsm.ongoing("SETTLE") | (fsm.ongoing("FLUSH") & self.pairs_empty)),
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
            NextValue(good, done.o),
            If(done.o | failed.o,
                If(self.core.streamed,
                    NextState("FLUSH")
                ).Else(
                    NextState("END")
                )
            )
        )
        # As long as no pair is in the crossing, the other side discards those in its registers.
        fsm.act("FLUSH",
            If(settle.done,
                NextState("END")
            )
        )
        fsm.act("END",
            If(good,
                self.done.eq(1),
                NextValue(self.frames, self.frames + 1)
            ).Else(
                self.failed.eq(1),
                NextValue(self.error_code, self.core.error_code)
            ),
            NextState("IDLE")
        )

    def add_pairs(self, begin):
        """Let the pairs of a streamed frame cross, up to its last one, and discard those that are left over."""
        self.pair_crossing = crossing = Crossing(pixel_pair_layout(), "sys", self.clock_domain, 16, self.reset)
        arrived  = stream.Endpoint(pixel_pair_layout())
        passes   = Signal() # Pairs of the frame are missing.
        complete = Signal() # All have come.
        flush    = Signal() # The frame is over: discard,
        discards = Signal() # as the other side sees it.
        first    = Signal(reset=1)
        pairs    = self.core.pairs
        add_register(self, crossing.source, arrived, self.clock_domain)
        self.specials += MultiReg(flush, discards, self.clock_domain)
        self.comb += [
            passes.eq(self.fsm.ongoing("FRAME") & self.core.streamed & ~self.aborted & ~complete),
            self.pairs.connect(crossing.sink, omit={"valid", "ready"}),
            crossing.sink.valid.eq(self.pairs.valid & passes),
            self.pairs.ready.eq(crossing.sink.ready & passes),
            self.pairs_empty.eq(crossing.empty),
            arrived.connect(pairs, omit={"valid", "ready", "first"}),
            pairs.first.eq(first),
            pairs.valid.eq(arrived.valid & ~discards),
            arrived.ready.eq(pairs.ready | discards),
        ]
        self.sync += [
            flush.eq(self.fsm.ongoing("FLUSH")),
            If(self.pairs.valid & self.pairs.ready & self.pairs.last,
                complete.eq(1)
            ),
            If(begin,
                complete.eq(0)
            ),
        ]
        sync  = getattr(self.sync, self.clock_domain)
        sync += [
            If(pairs.valid & pairs.ready,
                first.eq(0)
            ),
            If(self.core.start,
                first.eq(1)
            ),
        ]

    def add_map(self):
        """Let the map of a streamed frame cross; not what arrives after an abort."""
        renamed = ClockDomainsRenamer(self.clock_domain)
        self.map_crossing = crossing = Crossing(disparity_layout(), self.clock_domain, "sys", 16, self.reset)
        self.map_ready    = ready    = renamed(stream.PipeReady(self.core.map.description))
        self.map_data     = data     = renamed(stream.PipeValid(self.core.map.description))
        arrived = stream.Endpoint(disparity_layout())
        add_register(self, crossing.source, arrived)
        self.map_gone = Signal() # No pixel is on this side, nor in the crossing.
        self.comb += [
            self.core.map.connect(ready.sink),
            ready.source.connect(data.sink),
            data.source.connect(crossing.sink),
            self.map_gone.eq(~ready.source.valid & ~data.source.valid & crossing.empty),
            arrived.connect(self.map, omit={"valid", "ready"}),
            self.map.valid.eq(arrived.valid & ~self.aborted),
            arrived.ready.eq(1),
        ]

    def add_end(self, done, failed):
        """Report the end of a frame when its map has left the crossing."""
        sync = getattr(self.sync, self.clock_domain)
        for crossing, event in [(done, self.core.done), (failed, self.core.failed)]:
            ended = Signal()
            sync += If(event, ended.eq(1)).Elif(self.map_gone, ended.eq(0))
            self.comb += crossing.i.eq(ended & self.map_gone)

    def add_rectification(self, begin):
        """Let the nodes of the grids cross, but for those of the frame under way; take its flags over at its end."""
        self.load     = stream.Endpoint(node_layout(rectifier_parameters(self.parameters))) # Nodes; always ready.
        self.dropped  = Signal() # A node is dropped.
        self.row_gone = Signal() # A pixel of the last frame needed a row that was gone from its ring.
        self.folded   = Signal() # Its map folds over.
        in_use        = Signal()
        self.node_crossing = crossing = Crossing(self.load.description.payload_layout, "sys", self.clock_domain, 16,
            self.reset)
        add_register(self, crossing.source, self.core.load, self.clock_domain)
        self.comb += [
            in_use.eq(self.busy & self.core.rectified & (self.load.grid == self.core.grid)),
            self.load.connect(crossing.sink, omit={"valid", "ready"}),
            crossing.sink.valid.eq(self.load.valid & ~in_use),
            self.load.ready.eq(1),
            self.dropped.eq(self.load.valid & (in_use | ~crossing.sink.ready)),
        ]
        self.sync += [
            If(self.done,
                self.row_gone.eq(self.core.row_gone),
                self.folded.eq(self.core.folded)
            ),
            If(begin,
                self.row_gone.eq(0),
                self.folded.eq(0)
            ),
        ]

    def add_pulse(self, cd_from, cd_to):
        """Return a crossing for pulses of which at most one is under way."""
        crossing = PulseCrossing(cd_from, cd_to, reset=self.reset)
        self.submodules += crossing
        return crossing
