#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from types import SimpleNamespace

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common    import *
from .layouts    import *
from .map_grid   import MapGrid
from .remap      import Remap
from .row_window import RowWindow

# Clocks for which the settings of a frame hold before it begins: limits that are derived from others.
SETTLE_CLOCKS = 4

# Positions that the count of results does not show yet: one each in the count and in the credit, and one to spare.
UNCOUNTED_POSITIONS = 3

# Frames of which pairs are inside at once: the rows of one come in while the positions of the one before leave.
MOST_FRAMES = 2

# Rectifier ----------------------------------------------------------------------------------------

@ResetInserter()
class Rectifier(LiteXModule):
    """Raw pixel pairs in, rectified ones out, width x height per frame: bit for bit cv2.remap of the expanded grid.

    It consists of

    - `MapGrid`: where each rectified pixel is in the raw images;
    - `RowWindow`: which rows are in the rings, when pairs come in and when positions leave;
    - `Remap` for each camera: its ring of rows, and the interpolation;
    - a FIFO with room for all pairs under way, so that nothing between it and `RowWindow` stalls.

    A frame begins a clock before its first raw pair comes in, while that is offered; then it has the grid that `grid`
    says. `width`, `height`, `lead` and `bypass` are taken over while no frame is inside. A pair
    that comes with other settings waits until then.

    With `bypass` raw pairs leave in the clock in which they come in, and nothing else happens to them.

    `row_gone` and `folded` tell about the frame whose pairs leave, or have left last: from the clock after its last
    pair to the first pair of the next frame they are about all of it.

    Parameters
    ----------
    parameters : RectifierParameters
        What is built.
    """
    def __init__(self, parameters):
        self.parameters = parameters
        self.sink       = stream.Endpoint(pixel_pair_layout())     # Raw pairs, raster order; marks are ignored.
        self.source     = stream.Endpoint(pixel_pair_layout())     # Rectified pairs, raster order; first and last.
        self.load       = stream.Endpoint(node_layout(parameters)) # Nodes of a grid; always ready.

        self.width    = Signal(max=parameters.max_width + 1)  # Columns of the frame, at least 2.
        self.height   = Signal(max=parameters.max_height + 1) # Rows of the frame, at least 2.
        self.lead     = Signal(max=parameters.rows)           # Rows that may come in before they are needed.
        self.grid     = Signal()                              # Grid of the next frame.
        self.bypass   = Signal()                              # Do not rectify.
        self.busy     = Signal()                              # A frame is inside.
        self.row_gone = Signal()                              # A pixel needed a row that was gone from its ring.
        self.folded   = Signal()                              # The map folds over.
        self.refused  = Signal()                              # A node for the grid in use was dropped (pulse).
        self.latency  = None                                  # Depends on the map.

        # # #

        self.map_grid = MapGrid(parameters)
        self.window   = RowWindow(parameters)
        self.remaps   = [Remap(parameters) for _ in CAMERAS]
        self.submodules += self.remaps
        self.fifo     = stream.SyncFIFO(pixel_pair_layout() + [("row_gone", 1), ("folded", 1)], depth=self.fifo_depth())
        held, settled = self.add_settings()
        self.add_datapath(held)
        self.add_credit()
        self.add_frames(held, settled, self.add_bypass(held, settled))
        self.add_flags()

    def fifo_depth(self):
        """Return a depth with room for all pairs under way."""
        clocks_in_window = 2
        return 2**bits_for(clocks_in_window + self.remaps[0].latency + UNCOUNTED_POSITIONS + 1)

    def add_settings(self):
        """Hold the settings while frames are inside; return them, and whether they are those that are asked for."""
        names   = ("width", "height", "lead", "bypass")
        held    = SimpleNamespace(**{name: Signal.like(getattr(self, name), name=f"held_{name}") for name in names})
        same    = Signal()
        steady  = Signal(SETTLE_CLOCKS)
        settled = Signal()
        self.comb += [
            same.eq(Cat(*[getattr(held, name) for name in names]) == Cat(*[getattr(self, name) for name in names])),
            settled.eq(same & (steady == 2**SETTLE_CLOCKS - 1)),
        ]
        self.sync += [
            steady.eq(only_if(same, Cat(1, steady))),
            If(~self.busy,
                [getattr(held, name).eq(getattr(self, name)) for name in names]
            ),
        ]
        return held, settled

    def add_datapath(self, held):
        """Connect the cores, from the grid to the FIFO."""
        map_grid, window, fifo = self.map_grid, self.window, self.fifo
        self.comb += [
            self.load.connect(map_grid.sink),
            self.refused.eq(map_grid.refused),
            map_grid.width.eq(held.width),
            map_grid.height.eq(held.height),
            map_grid.source.connect(window.sink),
            window.width.eq(held.width),
            window.height.eq(held.height),
            window.lead.eq(held.lead),
        ]
        for camera, remap in zip(CAMERAS, self.remaps):
            self.comb += [
                remap.write.valid.eq(window.write.valid),
                remap.write.track.eq(window.write.track),
                remap.write.column.eq(window.write.column),
                remap.write.pixel.eq(getattr(window.write, camera)),
                remap.sink.valid.eq(window.source.valid),
                [getattr(remap.sink, name).eq(getattr(window.source, f"{camera}_{name}"))
                    for name, *_ in ring_position_layout(self.parameters)],
                getattr(fifo.sink, camera).eq(remap.source.pixel),
            ]
        remap = self.remaps[0]
        self.comb += [
            fifo.sink.valid.eq(remap.source.valid),
            fifo.sink.first.eq(delayed(self, window.source.frame_first, remap.latency)),
            fifo.sink.last.eq(delayed(self, window.source.frame_last, remap.latency)),
            fifo.sink.row_gone.eq(delayed(self, window.source.row_gone, remap.latency)),
            fifo.sink.folded.eq(delayed(self, window.source.folded, remap.latency)),
        ]

    def add_credit(self):
        """Give credit for as many pairs as the FIFO holds."""
        fifo = self.fifo
        used = Signal(max=fifo.depth + 1)
        give = Signal()
        self.comb += give.eq(fifo.source.valid & fifo.source.ready)
        self.sync += [
            used.eq(used + self.window.taken - give),
            self.window.credit.eq(used < fifo.depth - UNCOUNTED_POSITIONS),
        ]

    def add_frames(self, held, settled, passing):
        """Begin frames, first their pairs and then their positions, and count those inside."""
        window, map_grid = self.window, self.map_grid
        frames  = Signal(max=MOST_FRAMES + 1)
        waiting = Signal() # Positions of a frame whose pairs come in have not begun.
        ends    = Signal()
        self.comb += [
            window.begin.eq(self.sink.valid & settled & ~held.bypass & ~window.writing & ~waiting
                & (frames != MOST_FRAMES)),
            map_grid.begin.eq(waiting & ~map_grid.busy),
            ends.eq(self.fifo.source.valid & self.fifo.source.ready & self.fifo.source.last),
        ]
        grid = Signal()
        self.sync += [
            frames.eq(frames + window.begin - ends),
            If(map_grid.begin,
                waiting.eq(0)
            ),
            If(window.begin,
                waiting.eq(1),
                grid.eq(self.grid)
            ),
        ]
        self.comb += [
            map_grid.grid.eq(grid),
            map_grid.reserved.eq(waiting),
            self.busy.eq((frames != 0) | window.writing | window.ending | passing),
        ]

    def add_bypass(self, held, settled):
        """Connect both ends with window and FIFO, or with each other; return whether a frame passes that way."""
        sink, source, fifo = self.sink, self.source, self.fifo
        passing     = Signal()
        moves       = Signal()
        column      = Signal.like(held.width)
        row         = Signal.like(held.height)
        last_column = Signal.like(held.width)
        last_row    = Signal.like(held.height)
        self.comb += [
            moves.eq(held.bypass & sink.valid & sink.ready),
            If(held.bypass,
                sink.connect(source, omit={"valid", "ready"}),
                source.valid.eq(sink.valid & (passing | settled)),
                sink.ready.eq(source.ready & (passing | settled))
            ).Else(
                sink.connect(self.window.raw),
                fifo.source.connect(source, omit={"row_gone", "folded"})
            ),
        ]
        # Settings may change after the last pair of a frame, so pairs are counted here too.
        self.sync += [
            last_column.eq(held.width - 1),
            last_row.eq(held.height - 1),
            If(moves,
                passing.eq(1),
                column.eq(column + 1),
                If(column == last_column,
                    column.eq(0),
                    row.eq(row + 1),
                    If(row == last_row,
                        row.eq(0),
                        passing.eq(0)
                    )
                )
            ),
        ]
        return passing

    def add_flags(self):
        """Collect what the pixels of a frame tell, as they leave."""
        out = self.fifo.source
        for flag, pixel in ((self.row_gone, out.row_gone), (self.folded, out.folded)):
            self.sync += If(out.valid & out.ready,
                flag.eq((flag & ~out.first) | pixel)
            )
