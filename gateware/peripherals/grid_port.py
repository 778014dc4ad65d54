#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..rectification.layouts    import node_layout
from ..rectification.parameters import NODE_BITS

# Grid Port ----------------------------------------------------------------------------------------

class GridPort(LiteXModule):
    """Load the grids of a rectification node by node, as software writes them.

    `move` takes over where the next node belongs; each `write` sends a node there, and the place moves on to the next
    one in raster order. `damaged` tells which grid gets another node, and so is no longer that of a size. It is reset
    with its clock domain.

    Parameters
    ----------
    parameters : RectifierParameters
        What is built.
    """
    def __init__(self, parameters):
        self.source   = stream.Endpoint(node_layout(parameters)) # Nodes; never waits.
        self.camera   = Signal()            # Where the next node belongs: camera, 0 is the left one,
        self.grid     = Signal()            # grid,
        self.node     = Signal(16)          # and number in raster order.
        self.move     = Signal()            # Take that over (pulse).
        self.value    = Signal(2*NODE_BITS) # Displacement of a node: column in the low bits, row in the high ones.
        self.write    = Signal()            # Send it (pulse).
        self.dropped  = Signal()            # The node that is being sent is dropped.
        self.damaged  = Signal(2)           # A grid gets a node (pulse), a bit per grid.
        self.lost     = Signal()            # A node was dropped, or there is no such node; until the next `move`.
        self.latency  = 0

        # # #

        node   = Signal(16)
        camera = Signal()
        grid   = Signal()
        exists = Signal()
        self.comb += [
            exists.eq(node < parameters.nodes),
            self.source.valid.eq(self.write & exists),
            self.source.camera.eq(camera),
            self.source.grid.eq(grid),
            self.source.node.eq(node),
            self.source.column.eq(self.value[:NODE_BITS]),
            self.source.row.eq(self.value[NODE_BITS:]),
            self.damaged.eq(Cat(self.write & ~grid, self.write & grid)),
        ]
        self.sync += [
            If(self.write,
                node.eq(node + 1),
                If(~exists | self.dropped,
                    self.lost.eq(1)
                )
            ),
            If(self.move,
                camera.eq(self.camera),
                grid.eq(self.grid),
                node.eq(self.node),
                self.lost.eq(0)
            ),
        ]
