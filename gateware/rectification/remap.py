#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common  import *
from .bilinear import Bilinear
from .layouts  import *
from .row_ring import RowRing

# Remap --------------------------------------------------------------------------------------------

@ResetInserter()
class Remap(LiteXModule):
    """The rectified pixels of one camera: cv2.remap, INTER_LINEAR, fixed-point maps, border 0.

    Rows go into the ring; for each position the four pixels around it come out of it as one.
    """
    def __init__(self, parameters):
        self.write  = stream.Endpoint(ring_write_layout(parameters))    # Pipeline: pixels of the camera.
        self.sink   = stream.Endpoint(ring_position_layout(parameters)) # Pipeline: positions of rectified pixels.
        self.source = stream.Endpoint([("pixel", PIXEL_BITS)])          # Pipeline: rectified pixels.

        # # #

        self.ring     = ring     = RowRing(parameters)
        self.bilinear = bilinear = Bilinear()
        self.latency  = ring.latency + bilinear.latency
        self.comb += [
            connect_pipeline(self.write, ring.write),
            connect_pipeline(self.sink, ring.sink),
            connect_pipeline(ring.source, bilinear.sink),
            connect_pipeline(bilinear.source, self.source),
        ]
