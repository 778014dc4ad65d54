#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from functools import reduce
from operator  import and_, or_

from migen import *

from litex.gen import *
from litex.gen.genlib.misc import WaitTimer

from litex.soc.interconnect import stream

from ..common                 import *
from ..matcher.frame_settings import FrameSettings, frame_settings
from ..matcher.matcher        import Matcher, matcher_settings
from ..memory.pair_reader     import PairReader
from ..memory.ports           import word_bytes
from ..memory.stream_writer   import StreamWriter
from ..rectification.layouts  import node_layout
from .rectification           import Rectification, rectifier_parameters
from .stereo_csr              import PeripheralCSR

ERROR_NONE, ERROR_CONFIG, ERROR_BUS, ERROR_ABORTED = range(4)

# From start until it is known whether the settings are legal: those of the frame, the smallest width in two steps, the
# rules, their sum; and three to spare.
SETTLE_CLOCKS = 1 + 2 + 1 + 1 + 3

# A matcher of more disparities reaches across the FPGA: pairs from memory get a register on their way.
NEAR_DISPARITIES = 64

# Stereo Peripheral --------------------------------------------------------------------------------

class StereoPeripheral(PeripheralCSR, LiteXModule):
    """Matcher between memory and memory: registers, DMA and interrupts around `Matcher`.

    A streamed frame's pixels come from `pairs` instead, and its map goes to `map` as well as to memory. With the
    feature "rectification" all pairs pass through `Rectification` on their way to the matcher.

    Its settings are Signals named as in `frame_settings`. It is reset with its clock domain; bus accesses under way end
    with `abort` instead.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Ports through which the images are read and the map is written.
    parameters : MatcherParameters
        Of the matcher; its max_height is the largest one, as no register tells software another.
    burst_bytes : int
        Bytes that are read or written in one go.
    with_csr : bool
        Whether registers and interrupts are added.
    map_waits : bool
        Whether the map waits for the receiver of `map`; otherwise that may not stall.
    image_ports : sequence of wishbone.Interface or LiteDRAMNativePort
        Ports through which left and right image are written, with the feature "rectification" only.

    Raises
    ------
    ValueError
        The parameters have another max_height, there are other image ports, or the rectification cannot be built.
    """
    def __init__(self, read_port, write_port, parameters, burst_bytes=128, with_csr=True, map_waits=False,
        image_ports=()):
        check(parameters.max_height == MAX_HEIGHT,
            f"max_height of the peripheral must be {MAX_HEIGHT}, not {parameters.max_height}: no register tells it.")
        check(len(image_ports) == (2 if "rectification" in parameters.features else 0),
            "with the feature rectification there must be two image ports, and without it none, "
            f"not {len(image_ports)}.")
        self.parameters = parameters
        self.alignment  = max(map(word_bytes, (read_port, write_port, *image_ports))) # Bytes.

        self.matcher = Matcher(parameters)
        self.reader  = PairReader(read_port, burst_bytes)
        self.writer  = StreamWriter(write_port, DISPARITY_BITS, burst_bytes)
        self.frame   = FrameSettings(parameters, self.alignment) # Settings of the frame under way.

        self.pairs = stream.Endpoint(pixel_pair_layout()) # Pairs of a streamed frame, the first and the last marked.
        self.map   = stream.Endpoint(disparity_layout())  # Its map, as it goes to memory.

        # Settings, taken over at start.
        for name, bits in frame_settings(parameters.features):
            setattr(self, name, Signal(bits, name=name))
        # Control.
        self.start = Signal() # Begin a frame (pulse). Ignored while busy.
        self.abort = Signal() # Give the frame up (pulse). Ignored while idle.
        # Status.
        self.busy             = Signal()   # Between start and done or error.
        self.done             = Signal()   # The map is in memory (pulse).
        self.failed           = Signal()   # There will be no map: see error_code (pulse).
        self.error_code       = Signal(4)  # Of the last frame.
        self.clocks           = Signal(32) # Of the last frame, from start to done.
        self.first_row_clocks = Signal(32) # From start to the end of the first row that has disparities.
        self.frames           = Signal(32) # Frames done since reset.

        # # #

        begin = Signal() # A frame is accepted: its settings are taken over.
        legal = Signal() # They are legal; some clocks later.
        self.rectification = None
        if image_ports:
            self.add_rectification(image_ports, burst_bytes, begin)
        self.add_settings(begin, legal)
        self.add_frame(begin, legal)
        resetting = self.add_reset(begin)
        self.add_stream(self.pairs_from_memory(resetting), map_waits)
        if with_csr:
            self.add_csr()
            self.add_irq()

    def takes_pairs(self):
        """Return whether a streamed frame is under way, whose pairs it takes or has taken: an expression in `sys`."""
        return self.busy & self.frame.streamed

    def add_rectification(self, ports, burst_bytes, begin):
        """Build the rectification, its settings, and the loading of its grids."""
        frame         = self.frame
        in_use        = Signal() # A node for the grid of the frame under way is dropped: the frame has one grid.
        self.load     = stream.Endpoint(node_layout(rectifier_parameters(self.parameters))) # Nodes; always ready.
        self.dropped  = Signal() # A node is dropped.
        self.row_gone = Signal() # A pixel of the last frame needed a row that was gone from its ring.
        self.folded   = Signal() # Its map folds over.
        self.rectification = rectification = Rectification(self.parameters, ports, burst_bytes)
        self.comb += [
            [getattr(rectification, name).eq(getattr(frame, name)) for name in ("width", "height", "rectified", "grid",
                "left_out", "right_out", "left_out_base", "right_out_base")],
            in_use.eq(self.busy & frame.rectified & (self.load.grid == frame.grid)),
            self.load.connect(rectification.load, omit={"valid", "ready"}),
            rectification.load.valid.eq(self.load.valid & ~in_use),
            self.load.ready.eq(1),
            self.dropped.eq(self.load.valid & in_use),
        ]
        self.sync += [
            If(self.done,
                self.row_gone.eq(rectification.row_gone),
                self.folded.eq(rectification.folded)
            ),
            If(begin,
                self.row_gone.eq(0),
                self.folded.eq(0)
            ),
        ]

    def add_settings(self, begin, legal):
        """Take the settings over at `begin`, check them, and hand them to the cores."""
        frame  = self.frame
        pixels = Signal(32)
        self.sync += If(begin, [getattr(frame, name).eq(getattr(self, name))
            for name, _ in frame_settings(self.parameters.features)])
        self.sync += [
            legal.eq(frame.legal),
            pixels.eq(frame.width*frame.height),
        ]
        self.comb += [
            self.reader.left_base.eq(frame.left_base),
            self.reader.right_base.eq(frame.right_base),
            self.reader.pixels.eq(pixels),
            self.writer.base.eq(frame.disparity_base),
        ]
        self.comb += [getattr(self.matcher, name).eq(getattr(frame, name))
            for name, *_ in matcher_settings(self.parameters)]

    def add_frame(self, begin, legal):
        """Follow a frame from start to its end, good or bad."""
        reader, writer = self.reader, self.writer
        # All that accesses memory, and what is between them and the matcher.
        paths     = [reader, writer] + ([self.rectification] if self.rectification else [])
        settle    = WaitTimer(SETTLE_CLOCKS)
        next_code = Signal(4)
        aborted   = Signal() # Remembered until the frame has begun, and can be given up.
        self.submodules += settle
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += self.busy.eq(~fsm.ongoing("IDLE"))
        self.sync += [
            If(self.abort,
                aborted.eq(1)
            ),
            If(~self.busy,
                aborted.eq(0)
            ),
        ]
        fsm.act("IDLE",
            If(self.start,
                begin.eq(1),
                NextValue(self.error_code, ERROR_NONE),
                NextValue(self.clocks, 0),
                NextValue(self.first_row_clocks, 0),
                NextState("CHECK")
            )
        )
        fsm.act("CHECK",
            settle.wait.eq(1),
            NextValue(self.clocks, self.clocks + 1),
            If(settle.done,
                If(legal,
                    reader.start.eq(~self.frame.streamed),
                    [path.start.eq(1) for path in paths[1:]],
                    NextState("BEGIN")
                ).Else(
                    NextValue(next_code, ERROR_CONFIG),
                    NextState("STOP")
                )
            )
        )
        fsm.act("BEGIN",
            NextValue(self.clocks, self.clocks + 1),
            NextState("FRAME")
        )
        fsm.act("FRAME",
            NextValue(self.clocks, self.clocks + 1),
            If(self.matcher.first_row,
                NextValue(self.first_row_clocks, self.clocks + 1)
            ),
            If(self.abort | aborted,
                NextValue(next_code, ERROR_ABORTED),
                NextState("STOP")
            ).Elif(reduce(or_, [path.error for path in paths]),
                NextValue(next_code, ERROR_BUS),
                NextState("STOP")
            ).Elif(reduce(and_, [path.idle for path in paths]),
                self.done.eq(1),
                NextValue(self.frames, self.frames + 1),
                NextState("IDLE")
            )
        )
        fsm.act("STOP",
            [path.stop.eq(1) for path in paths],
            If(reduce(and_, [path.idle for path in paths]),
                self.failed.eq(1),
                NextValue(self.error_code, next_code),
                NextState("IDLE")
            )
        )

    def add_reset(self, begin):
        """Reset the matcher after a frame that was given up; return the Signal that does so."""
        # A register: this reaches half of the FPGA.
        resetting = Signal()
        self.sync += resetting.eq(self.fsm.ongoing("STOP"))
        self.comb += self.matcher.reset.eq(resetting)
        if self.rectification:
            # At the begin too: of a frame that passed unchanged it may be anywhere.
            beginning = Signal()
            self.sync += beginning.eq(begin)
            self.comb += self.rectification.reset.eq(resetting | beginning)
        return resetting

    def pairs_from_memory(self, resetting):
        """Return the stream of pairs that are read, after registers if the matcher is large."""
        source = self.reader.source
        if self.parameters.disparities > NEAR_DISPARITIES:
            self.read_ready = ready = ResetInserter()(stream.PipeReady(source.description))
            self.read_data  = data  = ResetInserter()(stream.PipeValid(source.description))
            self.comb += [
                ready.reset.eq(resetting),
                data.reset.eq(resetting),
                source.connect(ready.sink),
                ready.source.connect(data.sink),
            ]
            source = data.source
        return source

    def add_stream(self, read, map_waits):
        """Connect the matcher's streams to memory, and to `pairs` and `map` in a streamed frame."""
        matcher  = self.matcher
        streamed = self.frame.streamed
        sink     = self.writer.sink
        passes   = ~streamed | self.map.ready if map_waits else 1 # The receiver of the map does not stall.
        if self.rectification:
            # The matcher may have its last pair before the last raw one has come.
            entry    = self.rectification.sink
            complete = Signal()
            missing  = ~complete
            self.sync += complete.eq(self.busy & (complete | (entry.valid & entry.ready & entry.last)))
            self.comb += self.rectification.source.connect(matcher.sink)
        else:
            entry   = matcher.sink
            begun   = Signal() # The matcher has begun: when it is idle again, pairs on offer are of the next frame.
            missing = matcher.busy | ~begun
            self.sync += begun.eq(self.busy & (begun | matcher.busy))
        self.comb += [
            If(~streamed,
                read.connect(entry)
            ).Elif(self.fsm.ongoing("FRAME") & missing,
                self.pairs.connect(entry)
            ),
            matcher.source.connect(sink, omit={"disparity", "valid", "ready"}),
            sink.data.eq(matcher.source.disparity),
            sink.valid.eq(matcher.source.valid & passes),
            matcher.source.ready.eq(sink.ready & passes),
            # Without `passes`: an item is offered before the receiver is ready for it.
            self.map.valid.eq(streamed & matcher.source.valid & sink.ready),
            self.map.last.eq(matcher.source.last),
            self.map.disparity.eq(matcher.source.disparity),
        ]
