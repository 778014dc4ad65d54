#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from litex.soc.interconnect import stream

from ..cameras.dvp_signals       import DVPFormat, DVPSignals
from ..cameras.event_totals      import EventTotals
from ..cameras.frame_statistics  import FrameStatistics
from ..cameras.layouts           import SIDES
from ..cameras.pair_join         import PairJoin
from ..cameras.pair_matcher      import PairMatcher
from ..cameras.parameters        import STAMP_BITS
from ..cameras.pattern_source    import PatternSource
from ..cameras.sensor_capture    import SensorCapture
from ..cameras.test_pattern      import BLANKING_BITS
from ..cameras.trigger_generator import TriggerGenerator
from ..common                    import *
from .cameras_csr                import CameraCSR

# Camera -------------------------------------------------------------------------------------------

class Camera(LiteXModule):
    """One of the two sensors: its pixel clock, pattern, capture and statistics.

    While `enable` is 0 the domain of its pixel clock is in reset, and there are no frames. The reset of the system's
    domain resets that one too. What crosses between the two is said in `PatternSource` and `SensorCapture`.

    Parameters
    ----------
    parameters : CameraParameters
        What is built.
    side : str
        Name of the camera; the domain of its pixel clock is `<side>_pixel`.
    """
    def __init__(self, parameters, side):
        self.pixel_clk = Signal()     # Pixel clock of the sensor; its rising edge is when the signals are stable.
        self.sensor    = DVPSignals() # Signals of the sensor.
        self.format    = DVPFormat()  # How it uses them. Holds while `enable` is 1.
        self.enable    = Signal()     # Capture.

        # # #

        domain = f"{side}_pixel"
        pixel  = ClockDomain(domain)
        setattr(self, f"cd_{domain}", pixel)
        resets = Signal(reset=1)
        self.sync     += resets.eq(~self.enable)
        self.specials += MultiReg(resets, pixel.rst, domain, reset=1)
        self.pattern    = pattern    = PatternSource(parameters, domain)
        self.capture    = capture    = SensorCapture(parameters, domain)
        self.statistics = statistics = FrameStatistics(parameters)
        items = capture.crossing.source
        self.comb += [
            pixel.clk.eq(self.pixel_clk),
            pattern.sensor.eq(self.sensor),
            pattern.format.eq(self.format),
            capture.sensor.eq(pattern.source),
            capture.format.eq(pattern.source_format),
            statistics.sink.valid.eq(items.valid & items.ready),
            statistics.sink.kind.eq(items.kind),
            statistics.sink.pixel.eq(items.pixel),
        ]

# Camera Peripheral --------------------------------------------------------------------------------

class CameraPeripheral(CameraCSR, LiteXModule):
    """Two cameras: their captures, triggers, the pairs of their frames, statistics; registers and an interrupt.

        Camera ══> PairJoin ══> source ══> StereoPeripheral.pairs
        Camera ══>    ^
                 PairMatcher <── TriggerGenerator

    With `select` the pairs of `source` are those of the cameras, otherwise those of `others`. It is changed only while
    the matcher takes no pairs.

    It is reset with the system's clock domain, and the domains of both pixel clocks with it.

    Parameters
    ----------
    parameters : CameraParameters
        What is built.
    with_csr : bool
        Whether registers and the interrupt are added; without them the Signals are driven from outside.
    """
    def __init__(self, parameters, with_csr=True):
        self.parameters = parameters
        self.source  = stream.Endpoint(pixel_pair_layout()) # Pairs for the matcher.
        self.others  = stream.Endpoint(pixel_pair_layout()) # Pairs of another source.
        self.open    = Signal()                             # The matcher takes the pairs of a frame.
        self.latency = None                                 # Frames wait for each other.
        # Pins, all active at 1.
        self.trigger    = Signal()                                              # Exposure of both sensors.
        self.sleep      = [Signal(name=f"{side}_sleep")   for side in SIDES]    # Power-down of a sensor.
        self.restart    = [Signal(name=f"{side}_restart") for side in SIDES]    # Reset of a sensor.
        self.scl_i      = Signal()                                              # I2C: clock as it is.
        self.scl_low    = Signal()                                              # Pull it down.
        self.sda_i      = [Signal(name=f"{side}_sda_i")   for side in SIDES]    # Data of a sensor as it is.
        self.sda_low    = [Signal(name=f"{side}_sda_low") for side in SIDES]    # Pull it down.
        # Settings.
        self.select         = Signal()                              # Give out the pairs of the cameras.
        self.width          = Signal(max=parameters.max_width + 1)  # Size of a frame: columns,
        self.height         = Signal(max=parameters.max_height + 1) # and rows.
        self.silence        = Signal(parameters.silence_bits)       # Longest time without a mark, in clocks.
        self.clock_limit    = Signal(parameters.silence_bits)       # Longest time of eight pixel clocks, in clocks.
        self.disparity      = Signal(8)                             # Of the test pattern.
        self.row_blanking   = Signal(BLANKING_BITS)                 # Its clocks between rows,
        self.frame_blanking = Signal(BLANKING_BITS)                 # and frames.
        self.latch          = Signal()                              # Keep the time (pulse).
        self.latched        = Signal(STAMP_BITS)                    # The time that was kept.

        # # #

        self.cameras   = cameras = [Camera(parameters, side) for side in SIDES]
        self.submodules += cameras
        self.triggers  = TriggerGenerator()
        self.pairs     = PairMatcher()
        self.join      = PairJoin(parameters)
        self.add_cameras()
        self.add_pairs()
        self.add_output()
        self.add_totals()
        if with_csr:
            self.add_csr()
            self.add_irq()

    def add_cameras(self):
        """Connect what both cameras share, and each to the join."""
        join = self.join
        for number, camera in enumerate(self.cameras):
            guard = camera.capture.guard
            self.comb += [
                [getattr(camera.pattern, name).eq(getattr(self, name))
                    for name in ("width", "height", "row_blanking", "frame_blanking")],
                # The left one has a shift of 0.
                camera.pattern.shift.eq(self.disparity if number else 0),
                camera.capture.watch.limit.eq(self.clock_limit),
                camera.capture.source.connect(join.sinks[number]),
                guard.width.eq(join.frame_width),
                guard.height.eq(join.frame_height),
                guard.silence.eq(self.silence),
                guard.accept.eq(join.accept[number]),
                join.starts[number].eq(camera.capture.starts),
                join.begun[number].eq(guard.begun),
                join.dropped[number].eq(guard.dropped),
                join.ended[number].eq(guard.ended),
                join.damages[number].eq(guard.flags),
                self.pairs.starts[number].eq(camera.capture.starts),
            ]

    def add_pairs(self):
        """Connect triggers, the matcher of pairs, and the join."""
        triggers, pairs, join = self.triggers, self.pairs, self.join
        self.comb += [
            self.trigger.eq(triggers.trigger),
            pairs.now.eq(triggers.now),
            pairs.number.eq(triggers.number),
            pairs.exposure.eq(triggers.stamp),
            join.width.eq(self.width),
            join.height.eq(self.height),
            join.silence.eq(self.silence),
            join.connect_matcher(pairs),
        ]
        self.sync += If(self.latch,
            self.latched.eq(triggers.now)
        )

    def add_output(self):
        """Give out the pairs of the cameras, or the other ones."""
        join = self.join
        self.comb += [
            join.open.eq(self.open & self.select),
            If(self.select,
                join.source.connect(self.source)
            ).Else(
                self.others.connect(self.source)
            ),
        ]

    def add_totals(self):
        """Count what becomes of pairs, and tell when one is missed."""
        pairs, join = self.pairs, self.join
        self.missed  = Signal() # A frame or a pair has not come, or not whole, to the matcher (pulse).
        self.damaged = Signal() # A pair has ended, and was damaged or too far apart (pulse).
        events = {
            "finished":    join.finished,
            "refused":     join.refused,
            "given_up":    join.given_up,
            "apart":       pairs.dropped,
            "left_alone":  pairs.alone[0],
            "right_alone": pairs.alone[1],
        }
        self.counters = EventTotals(events)
        self.totals   = self.counters.totals # Counts, by name.
        self.comb += [
            self.missed.eq(join.refused | join.given_up | pairs.dropped | pairs.alone[0] | pairs.alone[1]),
            self.damaged.eq(join.finished & ((Cat(*join.damages) != 0) | join.info.flagged)),
        ]
