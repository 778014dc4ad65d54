#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common                   import *
from ..memory.stream_writer     import StreamWriter
from ..rectification.layouts    import CAMERAS, node_layout
from ..rectification.parameters import RectifierParameters
from ..rectification.rectifier  import Rectifier

# Rows that may come in before they are needed. More saves time only where frames follow one another without a pause.
LEAD = 2

# Helpers ------------------------------------------------------------------------------------------

def rectifier_parameters(parameters):
    """Return what the rectifier of a peripheral is built for; raise ValueError if it cannot be built."""
    return RectifierParameters(parameters.max_width, parameters.rectification_height, parameters.rectification_rows)

# Rectification ------------------------------------------------------------------------------------

class Rectification(LiteXModule):
    """What is between the source of a frame's pairs and the matcher: it rectifies them, and writes them to memory.

    Every pair passes through it. A frame may be rectified, and its left and right image may go to memory as the matcher
    gets them, rectified or not. A frame with neither passes without a clock more.

    A frame runs from `start` to its last pair. `stop`, held until `idle`, gives it up; then `reset` for a clock. The
    settings are stable from a clock before `start` until `idle`. `reset` leaves the grids and the writers alone, which
    are reset with their clock domain.

    Parameters
    ----------
    parameters : MatcherParameters
        Of the peripheral.
    ports : sequence of wishbone.Interface or LiteDRAMNativePort
        Ports through which the left and the right image are written.
    burst_bytes : int
        Bytes of a burst.
    """
    def __init__(self, parameters, ports, burst_bytes=128):
        built       = rectifier_parameters(parameters)
        self.sink   = stream.Endpoint(pixel_pair_layout()) # Pairs of the frame, the last one marked.
        self.source = stream.Endpoint(pixel_pair_layout()) # Pairs for the matcher, the first and the last marked.
        self.load   = stream.Endpoint(node_layout(built))  # Nodes of the grids; always ready.
        # Settings of the frame.
        self.width          = Signal(16) # Columns,
        self.height         = Signal(16) # and rows.
        self.rectified      = Signal()   # Rectify it,
        self.grid           = Signal()   # by this grid.
        self.left_out       = Signal()   # Write the left image,
        self.right_out      = Signal()   # and the right one.
        self.left_out_base  = Signal(32) # Byte address of the left image,
        self.right_out_base = Signal(32) # and of the right one.
        # Control and status.
        self.start    = Signal() # Begin a frame (pulse).
        self.stop     = Signal() # Give it up (level).
        self.reset    = Signal() # Forget the pairs inside.
        self.idle     = Signal() # No pair is inside, and the images are in memory.
        self.error    = Signal() # Bus error (pulse).
        self.row_gone = Signal() # A pixel of the frame needed a row that was gone from its ring.
        self.folded   = Signal() # Its map folds over.
        self.latency  = None     # Depends on the map.

        # # #

        self.rectifier = Rectifier(built)
        self.writers   = [StreamWriter(port, PIXEL_BITS, burst_bytes) for port in ports]
        self.submodules += self.writers
        self.add_rectifier()
        self.add_images()

    def add_rectifier(self):
        """Connect the rectifier; of a frame that is not rectified its flags and its state do not count."""
        rectifier = self.rectifier
        self.comb += [
            rectifier.reset.eq(self.reset),
            self.sink.connect(rectifier.sink),
            self.load.connect(rectifier.load),
            rectifier.width.eq(self.width),
            rectifier.height.eq(self.height),
            rectifier.lead.eq(LEAD),
            rectifier.grid.eq(self.grid),
            rectifier.bypass.eq(~self.rectified),
            self.row_gone.eq(self.rectified & rectifier.row_gone),
            self.folded.eq(self.rectified & rectifier.folded),
            self.idle.eq(~(self.rectified & rectifier.busy) & self.writers[0].idle & self.writers[1].idle),
            self.error.eq(self.writers[0].error | self.writers[1].error),
        ]

    def add_images(self):
        """Hand the pairs on to the matcher and to the writers of the images that are asked for, to all at once."""
        pairs  = self.rectifier.source
        rooms  = [] # What is asked for has room.
        for camera, writer in zip(CAMERAS, self.writers):
            wanted = getattr(self, f"{camera}_out")
            room   = Signal(name=f"{camera}_room")
            rooms.append(room)
            self.comb += [
                room.eq(~wanted | writer.sink.ready),
                writer.base.eq(getattr(self, f"{camera}_out_base")),
                writer.start.eq(self.start & wanted),
                writer.stop.eq(self.stop),
                writer.sink.data.eq(getattr(pairs, camera)),
                writer.sink.last.eq(pairs.last),
            ]
        self.comb += [
            pairs.connect(self.source, omit={"valid", "ready"}),
            self.source.valid.eq(pairs.valid & rooms[0] & rooms[1]),
            pairs.ready.eq(self.source.ready & rooms[0] & rooms[1]),
            # Neither writer needs to know whether it has room.
            self.writers[0].sink.valid.eq(pairs.valid & self.source.ready & rooms[1] & self.left_out),
            self.writers[1].sink.valid.eq(pairs.valid & self.source.ready & rooms[0] & self.right_out),
        ]
