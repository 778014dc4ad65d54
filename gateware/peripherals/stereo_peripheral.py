#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

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

    A streamed frame's pixels come from `pairs` instead, and its map goes to `map` as well as to memory.

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

    Raises
    ------
    ValueError
        The parameters have another max_height.
    """
    def __init__(self, read_port, write_port, parameters, burst_bytes=128, with_csr=True, map_waits=False):
        check(parameters.max_height == MAX_HEIGHT,
            f"max_height of the peripheral must be {MAX_HEIGHT}, not {parameters.max_height}: no register tells it.")
        self.parameters = parameters
        self.alignment  = max(word_bytes(read_port), word_bytes(write_port)) # Bytes.

        self.matcher = Matcher(parameters)
        self.reader  = PairReader(read_port, burst_bytes)
        self.writer  = StreamWriter(write_port, DISPARITY_BITS, burst_bytes)
        self.frame   = FrameSettings(parameters, self.alignment) # Settings of the frame under way.

        self.pairs = stream.Endpoint(pixel_pair_layout()) # Pairs of a streamed frame, the first and the last marked.
        self.map   = stream.Endpoint(disparity_layout())  # Its map, as it goes to memory.

        # Settings, taken over at start.
        for name, bits in frame_settings():
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
        self.add_settings(begin, legal)
        self.add_frame(begin, legal)
        resetting = self.add_reset()
        self.add_stream(self.pairs_from_memory(resetting), map_waits)
        if with_csr:
            self.add_csr()
            self.add_irq()

    def add_settings(self, begin, legal):
        """Take the settings over at `begin`, check them, and hand them to the cores."""
        frame  = self.frame
        pixels = Signal(32)
        self.sync += If(begin, [getattr(frame, name).eq(getattr(self, name)) for name, _ in frame_settings()])
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
                    writer.start.eq(1),
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
            ).Elif(reader.error | writer.error,
                NextValue(next_code, ERROR_BUS),
                NextState("STOP")
            ).Elif(reader.idle & writer.idle,
                self.done.eq(1),
                NextValue(self.frames, self.frames + 1),
                NextState("IDLE")
            )
        )
        fsm.act("STOP",
            reader.stop.eq(1),
            writer.stop.eq(1),
            If(reader.idle & writer.idle,
                self.failed.eq(1),
                NextValue(self.error_code, next_code),
                NextState("IDLE")
            )
        )

    def add_reset(self):
        """Reset the matcher after a frame that was given up; return the Signal that does so."""
        # A register: this reaches half of the FPGA.
        resetting = Signal()
        self.sync += resetting.eq(self.fsm.ongoing("STOP"))
        self.comb += self.matcher.reset.eq(resetting)
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
        begun    = Signal() # The matcher has begun: when it is idle again, pairs on offer are of the next frame.
        self.sync += begun.eq(self.busy & (begun | matcher.busy))
        self.comb += [
            If(~streamed,
                read.connect(matcher.sink)
            ).Elif(self.fsm.ongoing("FRAME") & (matcher.busy | ~begun),
                self.pairs.connect(matcher.sink)
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
