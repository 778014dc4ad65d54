#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from litex.soc.interconnect import stream

from ..common.crossing        import Crossing
from ..common.crossing_reset  import CrossingReset, GrayPointer
from ..common.stream_register import add_register
from .layouts                 import *

LOST_BITS = 16 # Of the count of lost items.

# Sensor Crossing ----------------------------------------------------------------------------------

class SensorCrossing(LiteXModule):
    """The items of a sensor, from the domain of its pixel clock to that of the system.

    A sensor does not wait. An item that finds the crossing full is lost and counted, and the next one that finds room
    says so in `lost`. The count crosses as a Gray code, so it is right also while nothing else passes, as of some
    clocks ago.

    A reset of either domain empties the crossing and sets the count to 0: see `CrossingReset`. Until both sides have
    agreed on that, items are discarded and not counted.

    Parameters
    ----------
    cd_from, cd_to : str
        Clock domains of sensor and system.
    depth : int
        Room in items, a power of 2.
    """
    def __init__(self, cd_from="pixel", cd_to="sys", depth=32):
        self.sink    = stream.Endpoint(sensor_layout())   # Pipeline, in `cd_from`: items of the sensor.
        self.source  = stream.Endpoint(captured_layout()) # In `cd_to`: those that were not lost.
        self.lost    = Signal(LOST_BITS)                  # In `cd_to`: items lost, modulo 2**LOST_BITS.
        self.latency = None                               # Depends on both clocks.

        # # #

        self.cd_from, self.cd_to = cd_from, cd_to
        self.reset    = CrossingReset(cd_from, cd_to)
        self.crossing = Crossing(captured_layout(), cd_from, cd_to, depth, self.reset)
        self.add_entry()
        add_register(self, self.crossing.source, self.source, cd_to)

    def add_entry(self):
        """Write items, and count those that find no room."""
        sink, entry = self.sink, self.crossing.sink
        gap   = Signal() # Items in front of the next one were lost.
        loses = Signal()
        sync  = getattr(self.sync, self.cd_from)
        self.comb += [
            # An item is withdrawn when there is no room: the crossing allows that.
            entry.valid.eq(sink.valid),
            entry.kind.eq(sink.kind),
            entry.pixel.eq(sink.pixel),
            entry.lost.eq(gap),
            loses.eq(sink.valid & ~entry.ready & ~self.reset.blocked[self.cd_from]),
        ]
        sync += [
            If(entry.valid & entry.ready,
                gap.eq(0)
            ),
            If(loses,
                gap.eq(1)
            ),
        ]
        self.add_count(loses)

    def add_count(self, loses):
        """Count lost items, and show the count to the system."""
        count = ClockDomainsRenamer(self.cd_from)(GrayPointer(LOST_BITS))
        seen  = Signal(LOST_BITS)
        self.submodules += count
        self.specials   += MultiReg(count.q, seen, self.cd_to)
        self.comb += [
            count.ce.eq(loses),
            count.clear.eq(self.reset.clear[self.cd_from]),
        ]
        # Each bit of a number is the parity of the bits of its Gray code from there up.
        sync  = getattr(self.sync, self.cd_to)
        sync += [self.lost[bit].eq(Reduce("XOR", seen[bit:])) for bit in range(LOST_BITS)]
