#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *
from litex.gen.genlib.misc import WaitTimer

from litex.soc.interconnect.csr              import *
from litex.soc.interconnect.csr_eventmanager import *
from litex.soc.integration.doc               import ModuleDoc

from .common      import *
from .map_writer  import MapWriter
from .matcher     import Matcher
from .memory_port import word_bytes
from .pair_reader import PairReader

VERSION = (0, 1) # Of the register interface: major, minor.

ERROR_NONE, ERROR_CONFIG, ERROR_BUS, ERROR_ABORTED = range(4)

# Stereo Peripheral --------------------------------------------------------------------------------

class StereoPeripheral(LiteXModule):
    """Matcher between memory and memory: registers, DMA and interrupts around `Matcher`.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Ports through which the images are read and the map is written.
    max_width, disparities, max_block_size : int
        Of the matcher.
    burst_bytes : int
        Bytes that are read or written in one go.
    """
    def __init__(self, read_port, write_port, max_width=640, disparities=64, max_block_size=9, burst_bytes=128,
        with_csr=True):
        max_height   = 4095
        self.matcher = matcher = Matcher(max_width, max_height, disparities, max_block_size)
        self.reader  = reader  = PairReader(read_port, burst_bytes)
        self.writer  = writer  = MapWriter(write_port, burst_bytes)

        self.parameters = dict(max_width=max_width, disparities=disparities, max_block_size=max_block_size)
        self.alignment  = max(word_bytes(read_port), word_bytes(write_port)) # Bytes.

        # Settings, taken over at start.
        self.left_base      = Signal(32) # Byte address of the left image.
        self.right_base     = Signal(32) # Byte address of the right image.
        self.disparity_base = Signal(32) # Byte address of the map.
        self.width          = Signal(16) # Columns.
        self.height         = Signal(16) # Rows.
        self.disparities    = Signal(9)  # Disparities to search.
        self.block_size     = Signal(6)  # Side of the block.
        # Control.
        self.start = Signal() # Begin a frame (pulse). Ignored while busy.
        self.abort = Signal() # Give the frame up (pulse). Ignored while idle.
        # Status.
        self.busy             = Signal()   # Between start and done or error.
        self.done             = Signal()   # The map is in memory (pulse).
        self.failed           = Signal()   # There will be no map: see error_code (pulse).
        self.error_code       = Signal(4)  # Of the last frame.
        self.clocks           = Signal(32) # Of the last frame, from start to done.
        self.first_row_clocks = Signal(32) # Likewise, to the end of the first row that has disparities.
        self.frames           = Signal(32) # Frames done since reset.

        # # #

        # Settings of the frame.
        # ----------------------
        begin = Signal()
        frame = {}
        for name in ["left_base", "right_base", "disparity_base", "width", "height", "disparities", "block_size"]:
            setting     = getattr(self, name)
            frame[name] = Signal.like(setting)
            self.sync += If(begin, frame[name].eq(setting))
        pixels = Signal(32)
        self.sync += pixels.eq(frame["width"]*frame["height"])
        self.comb += [
            reader.left_base.eq(frame["left_base"]),
            reader.right_base.eq(frame["right_base"]),
            reader.pixels.eq(pixels),
            writer.base.eq(frame["disparity_base"]),
            matcher.width.eq(frame["width"]),
            matcher.height.eq(frame["height"]),
            matcher.disparities.eq(frame["disparities"]),
            matcher.block_size.eq(frame["block_size"]),
        ]

        # Legal settings.
        # ---------------
        legal       = Signal()
        min_width   = Signal(16)
        misaligned  = Signal()
        low_bits    = log2_int(self.alignment)
        self.comb += misaligned.eq(
            (frame["left_base"][:low_bits] != 0) | (frame["right_base"][:low_bits] != 0) |
            (frame["disparity_base"][:low_bits] != 0))
        self.sync += [
            min_width.eq(frame["disparities"] + frame["block_size"] - 1),
            legal.eq(
                (frame["width"] <= max_width) & (frame["width"] >= min_width) &
                (frame["height"] <= max_height) & (frame["height"] >= frame["block_size"]) &
                (frame["disparities"][:4] == 0) & (frame["disparities"] != 0) & (frame["disparities"] <= disparities) &
                frame["block_size"][0] & (frame["block_size"] >= MIN_BLOCK_SIZE) &
                (frame["block_size"] <= max_block_size) & ~misaligned),
        ]

        # Frame.
        # ------
        settle    = WaitTimer(4)
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
                    reader.start.eq(1),
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
            If(matcher.first_row,
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
            matcher.reset.eq(1),
            If(reader.idle & writer.idle,
                self.failed.eq(1),
                NextValue(self.error_code, next_code),
                NextState("IDLE")
            )
        )

        # Stream.
        # -------
        self.comb += [
            reader.source.connect(matcher.sink),
            matcher.source.connect(writer.sink),
        ]

        if with_csr:
            self.add_csr()
            self.add_irq()

    def add_irq(self):
        self.ev        = EventManager()
        self.ev.done   = EventSourcePulse(description="The disparity map of the frame is in memory.")
        self.ev.error  = EventSourcePulse(description="The frame was refused or given up: see ``status``.")
        self.ev.finalize()
        self.comb += [
            self.ev.done.trigger.eq(self.done),
            self.ev.error.trigger.eq(self.failed),
        ]

    def add_csr(self):
        self.intro = ModuleDoc("""Stereo matcher

        Computes the disparity map of a rectified pair of 8-bit grey images, from memory to memory.

        To match a pair: write the bases, the size and the settings; write 1 to ``start`` in ``control``; wait for the
        ``done`` or ``error`` event; read ``status``. All settings are taken over at ``start``, so those of the next
        frame may be written meanwhile. Images and map are in raster order without padding between rows; one byte is
        a pixel of an image, an int16 in sixteenths of a pixel one of the map, -16 where there is no disparity. Whole
        words are written: up to ``dma_alignment`` - 2 bytes behind the map are overwritten with undefined values.

        A CPU that caches has to invalidate its lines of the map before it reads them.
        """)
        built = self.parameters

        # Settings.
        # ---------
        def setting(name, description):
            storage = CSRStorage(len(getattr(self, name)), name=name, description=description)
            setattr(self, f"_{name}", storage)
            self.comb += getattr(self, name).eq(storage.storage)

        setting("left_base",      "Byte address of the left image, a multiple of ``dma_alignment``.")
        setting("right_base",     "Byte address of the right image, a multiple of ``dma_alignment``.")
        setting("disparity_base", "Byte address of the map, a multiple of ``dma_alignment``.")
        setting("width",          "Columns of the images, from ``disparities`` + ``block_size`` - 1 to ``max_width``.")
        setting("height",         "Rows of the images, from ``block_size`` to 4095.")
        setting("disparities",    "Disparities to search, from 0 up: a multiple of 16 up to ``max_disparities``.")
        setting("block_size",     "Side of the block in pixels, odd, within ``block_sizes``.")

        # Control and status.
        # -------------------
        self._control = CSRStorage(name="control", fields=[
            CSRField("start", size=1, pulse=True, description="Write 1 to begin a frame. Ignored while busy."),
            CSRField("abort", size=1, pulse=True, description="Write 1 to give the frame up. Ignored while idle."),
        ])
        self._status = CSRStatus(name="status", fields=[
            CSRField("busy",  size=1, offset=0, description="A frame is under way."),
            CSRField("error", size=4, offset=8, description="How the last frame ended.", values=[
                ("``0``", "Well, or it has not ended yet."),
                ("``1``", "Refused: a setting is out of range or a base is not aligned."),
                ("``2``", "Given up: the bus answered with an error."),
                ("``3``", "Given up: aborted."),
            ]),
        ])
        self.comb += [
            self.start.eq(self._control.fields.start),
            self.abort.eq(self._control.fields.abort),
            self._status.fields.busy.eq(self.busy),
            self._status.fields.error.eq(self.error_code),
        ]

        # Measurements.
        # -------------
        def measurement(name, description):
            status = CSRStatus(32, name=name, description=description)
            setattr(self, f"_{name}", status)
            self.comb += status.status.eq(getattr(self, name))

        measurement("clocks",           "Clocks of the last frame, from start until its map is in memory.")
        measurement("first_row_clocks", "Clocks from start to the end of the first row that has disparities.")
        measurement("frames",           "Frames done since reset.")

        # Capabilities.
        # -------------
        def capability(name, size, value, description):
            setattr(self, f"_{name}", CSRStatus(size, reset=value, name=name, description=description))

        capability("version",         16, VERSION[0]*256 + VERSION[1], "Register interface: major x 256 + minor.")
        capability("max_width",       16, built["max_width"],          "Widest frame, pixels.")
        capability("max_disparities",  9, built["disparities"],        "Largest number of disparities.")
        capability("block_sizes",     16, MIN_BLOCK_SIZE | built["max_block_size"] << 8,
            "Smallest block size in bits 0 to 7, largest in bits 8 to 15.")
        capability("features",        32, 0,                           "One bit per optional stage; none yet.")
        capability("dma_alignment",    8, self.alignment,              "Alignment of the bases, bytes.")
