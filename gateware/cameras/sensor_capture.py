#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from litex.soc.interconnect import stream

from ..common         import connect_pipeline
from .clock_watch     import ClockWatch
from .dvp_receiver    import DVPReceiver
from .dvp_signals     import DVPFormat, DVPSignals
from .event_totals    import EventTotals
from .frame_guard     import DAMAGES, FrameGuard
from .layouts         import *
from .sensor_crossing import SensorCrossing

# Sensor Capture -----------------------------------------------------------------------------------

class SensorCapture(LiteXModule):
    """The frames of one sensor, from its signals to a stream of the system, with counters.

        DVPReceiver ──> SensorCrossing ══> FrameGuard ══>
         pixel clock                │        system clock

        ──  pipeline          ══  stream

    Its settings are those of `guard` and `watch`. A reset of either domain forgets the frame that is under way. If the
    sensor's clock is stopped, the system's side of the crossing waits for it, and `starts` and `source` are silent.

    Parameters
    ----------
    parameters : CameraParameters
        What is built.
    cd_pixel : str
        Domain of the pixel clock. Its edge is the one at which the sensor's signals are stable.
    """
    def __init__(self, parameters, cd_pixel="pixel"):
        self.sensor  = DVPSignals()                    # In `cd_pixel`: signals of the sensor.
        self.format  = DVPFormat()                     # In `cd_pixel`: how it uses them; see there.
        self.source  = stream.Endpoint(pixel_layout()) # Frames, raster order; first and last.
        self.starts  = Signal()                        # The sensor begins a frame, accepted or not (pulse).
        self.totals  = {}                              # Counts of `DAMAGES`, of frames and of drops, by name.
        self.latency = None                            # Crosses clock domains.

        # # #

        self.guard    = guard    = FrameGuard(parameters)
        self.receiver = receiver = ClockDomainsRenamer(cd_pixel)(DVPReceiver())
        self.crossing = crossing = SensorCrossing(cd_pixel, "sys")
        self.watch    = ClockWatch(parameters.silence_bits, cd_pixel)
        self.comb += [
            receiver.sensor.eq(self.sensor),
            receiver.format.eq(self.format),
            connect_pipeline(receiver.source, crossing.sink),
            crossing.source.connect(guard.sink),
            guard.source.connect(self.source),
        ]
        self.add_starts(receiver)
        self.add_totals(guard)

    def add_starts(self, receiver):
        """Tell the starts of frames without delay by what waits in the crossing."""
        active = Signal()
        before = Signal(reset=1) # A frame that is under way at a reset does not start.
        self.specials += MultiReg(receiver.active, active)
        self.sync += [
            before.eq(active),
            self.starts.eq(active & ~before),
        ]

    def add_totals(self, guard):
        """Count damages, frames that have ended, and drops."""
        events = {name: guard.events[name] for name in DAMAGES}
        events |= {"frames": guard.ended, "dropped": guard.dropped}
        self.counters = counters = EventTotals(events)
        self.totals.update(counters.totals)
