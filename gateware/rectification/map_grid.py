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
from .parameters import FRACTION_BITS, GRIDS, NODE_BITS, NODE_FRACTION, STEP_BITS

# Number Formats -----------------------------------------------------------------------------------

EDGE_BITS  = NODE_BITS + STEP_BITS + 1 # Displacement down a column of nodes, with half a unit of the result added.
VALUE_BITS = EDGE_BITS + STEP_BITS     # Displacement of a pixel.

# Bits of a value below the result, which has FRACTION_BITS.
DROPPED_BITS = NODE_FRACTION + 2*STEP_BITS - FRACTION_BITS

# Displacements per pixel at which a row, or a column, of positions does not move on any more.
FOLD_ROW    = 2**(NODE_FRACTION + STEP_BITS)   # Of two nodes one above the other.
FOLD_COLUMN = 2**(NODE_FRACTION + 2*STEP_BITS) # Of two pixels side by side.

# Clocks of a node: its address, that of the one below, both words, four additions, and the step from the node before.
NODE_PHASES = 8

# Map Grid -----------------------------------------------------------------------------------------

@ResetInserter()
class MapGrid(LiteXModule):
    """The map of both cameras: where each rectified pixel is in the raw images, interpolated between nodes.

    Nodes are 16 pixels apart, in columns and rows 0, 16, ..., up to the first one at or beyond the last pixel. A node
    is a displacement, the position less the pixel's own place, in 128ths of a pixel for column and row. The pixel in
    column 16*j + k and row 16*i + l, with nodes n, has for each of the two

        left  = (n[i][j]   << 4) + l*(n[i+1][j]   - n[i][j])
        right = (n[i][j+1] << 4) + l*(n[i+1][j+1] - n[i][j+1])
        value = (left << 4) + k*(right - left)
        result = ((value + 512) >> 10) + 32*place        in 32nds of a pixel

    There is no product per pixel. Along a row each value is the one before plus right - left. The product with l is
    made once per node and row, bit by bit, while sixteen pixels leave: from 24 columns on a position leaves in each
    clock.

    There are two grids. `grid` says at `begin` which one a frame has. Nodes of the other one come in at any time; those
    for the grid of the frame under way, or that of the next one while it is `reserved`, are dropped, with a pulse on
    `refused`.

    ``folded`` marks the pixels between two columns of nodes where the map folds over: the next position is not to the
    right of this one, or the next node below is not below.
    """
    def __init__(self, parameters):
        self.sink   = stream.Endpoint(node_layout(parameters))            # Nodes; always ready.
        self.source = stream.Endpoint(source_position_layout(parameters)) # Positions, in raster order.

        self.width    = Signal(max=parameters.max_width + 1)  # Columns of the frame.
        self.height   = Signal(max=parameters.max_height + 1) # Rows of the frame.
        self.begin    = Signal()                              # Start a frame (pulse, while not busy).
        self.grid     = Signal()                              # Grid of that frame.
        self.reserved = Signal()                              # A frame with that grid will begin.
        self.busy     = Signal()                              # Positions of a frame are missing.
        self.refused  = Signal()                              # A node was dropped (pulse).
        self.latency  = None                                  # Nodes go into a memory.

        # # #

        self.parameters = parameters
        limits  = self.add_limits()
        address = Signal(max=GRIDS*parameters.nodes)
        words   = self.add_memories(address)
        walk    = self.add_walk(limits, address)
        axes    = [half for word in words for half in (word[:NODE_BITS], word[NODE_BITS:])]
        piece   = self.add_pieces(walk, [self.add_edge(walk, axis) for axis in axes])
        active  = self.add_pixels(limits, piece)
        self.comb += self.busy.eq(walk.busy | piece.valid | active)

    def add_limits(self):
        """Register what depends on the size: columns of nodes, last node of a row, last column and row."""
        parameters = self.parameters
        limits = SimpleNamespace(
            nodes  = Signal(max=parameters.node_columns + 1),
            node   = Signal(max=parameters.node_columns + 1),
            column = Signal(max=parameters.max_width + 1),
            row    = Signal(max=parameters.max_height + 1),
        )
        self.sync += [
            limits.column.eq(self.width - 1),
            limits.row.eq(self.height - 1),
            limits.node.eq(limits.column[STEP_BITS:] + 1),
            limits.nodes.eq(limits.column[STEP_BITS:] + 2),
        ]
        return limits

    def add_memories(self, address):
        """Return each camera's word at the address of a clock ago; write nodes, but not those of the grid in use."""
        sink     = self.sink
        in_use   = Signal()
        used     = Signal()
        accepted = Signal()
        target   = Signal.like(address)
        self.sync += If(self.begin, in_use.eq(self.grid))
        self.comb += [
            used.eq((self.busy & (sink.grid == in_use))
                | ((self.begin | self.reserved) & (sink.grid == self.grid))),
            sink.ready.eq(1),
            accepted.eq(sink.valid & ~used),
            self.refused.eq(sink.valid & used),
            target.eq(sink.node + Mux(sink.grid, self.parameters.nodes, 0)),
        ]
        words = []
        for number in range(len(CAMERAS)):
            memory = Memory(2*NODE_BITS, GRIDS*self.parameters.nodes, name="map_nodes")
            read   = memory.get_port(mode=READ_FIRST)
            write  = memory.get_port(write_capable=True, mode=READ_FIRST)
            self.specials += memory, read, write
            self.comb += [
                read.adr.eq(address),
                write.adr.eq(target),
                write.dat_w.eq(Cat(sink.column, sink.row)),
                write.we.eq(accepted & (sink.camera == number)),
            ]
            words.append(read.dat_r)
        return words

    def add_walk(self, limits, address):
        """Visit the nodes of each row of pixels, one in NODE_PHASES clocks; return where it is.

        `hold`, an input, stops it in the last phase of a node.
        """
        walk = SimpleNamespace(
            busy  = Signal(),
            hold  = Signal(),
            step  = Signal(),                 # To the next node.
            phase = Signal(max=NODE_PHASES),
            line  = Signal(STEP_BITS),        # Of the pixels, below the upper nodes.
            node  = Signal.like(limits.node), # Column of nodes.
        )
        self.comb += walk.step.eq(walk.busy & (walk.phase == NODE_PHASES - 1) & ~walk.hold)
        self.sync += [
            If(walk.busy & ((walk.phase != NODE_PHASES - 1) | walk.step),
                walk.phase.eq(walk.phase + 1)
            ),
            If(self.begin,
                walk.phase.eq(0)
            ),
        ]
        row_ends = Signal()
        row      = Signal.like(limits.row)
        self.comb += row_ends.eq(walk.step & (walk.node == limits.node))
        self.sync += [
            If(walk.step,
                walk.node.eq(walk.node + 1)
            ),
            If(row_ends,
                walk.node.eq(0),
                walk.line.eq(walk.line + 1),
                row.eq(row + 1),
                If(row == limits.row,
                    walk.busy.eq(0)
                )
            ),
            If(self.begin,
                walk.busy.eq(1),
                walk.node.eq(0),
                walk.line.eq(0),
                row.eq(0)
            ),
        ]
        self.add_node_addresses(limits, walk, row_ends, address)
        return walk

    def add_node_addresses(self, limits, walk, row_ends, address):
        """Read the upper node in phase 0, the one below in phase 1 and until the next node."""
        first      = Signal.like(address) # First nodes of both rows of nodes.
        below      = Signal.like(address)
        upper      = Signal.like(address) # Nodes in this column.
        lower      = Signal.like(address)
        start      = Signal.like(address)
        next_first = Signal.like(address)
        next_below = Signal.like(address)
        self.comb += [
            address.eq(Mux(walk.phase == 0, upper, lower)),
            start.eq(Mux(self.grid, self.parameters.nodes, 0)),
            next_first.eq(Mux(self.begin, start, Mux(walk.line == 2**STEP_BITS - 1, below, first))),
            next_below.eq(next_first + limits.nodes),
        ]
        self.sync += [
            If(walk.step,
                upper.eq(upper + 1),
                lower.eq(lower + 1)
            ),
            If(row_ends | self.begin,
                first.eq(next_first),
                upper.eq(next_first),
                below.eq(next_below),
                lower.eq(next_below)
            ),
        ]

    def add_edge(self, walk, word):
        """Return the displacement down a column of nodes, for the last phase, and whether the map folds over there.

        The product with the line is made of its bits, the lowest first, in phases 3 to 6.
        """
        node       = Signal(NODE_BITS)
        difference = Signal(EDGE_BITS)     # Twice as large in each of these phases.
        remaining  = Signal(STEP_BITS)     # Bits of the line.
        raised     = Signal(NODE_BITS + 1)
        edge       = Signal(EDGE_BITS)
        # Half a unit of the result: dropping bits then rounds. It is the same for all nodes, so no step has it.
        self.comb += raised.eq(sign_extended(node, NODE_BITS + 1) + 2**(DROPPED_BITS - 1 - 2*STEP_BITS))
        self.sync += [
            If(walk.phase == 1,
                node.eq(word)
            ),
            difference.eq(difference << 1),
            remaining.eq(remaining[1:]),
            If(remaining[0],
                edge.eq(edge + difference)
            ),
            If(walk.phase == 2,
                difference.eq(sign_extended(word, EDGE_BITS) - sign_extended(node, EDGE_BITS)),
                remaining.eq(walk.line),
                edge.eq(Cat(Replicate(0, STEP_BITS), raised))
            ),
        ]
        gap    = Signal(EDGE_BITS)
        folded = Signal()
        self.comb += gap.eq(difference + FOLD_ROW)
        self.sync += If(walk.phase == 3, folded.eq(gap[-1] | (gap == 0)))
        return edge, folded

    def add_pieces(self, walk, edges):
        """Return the piece of a row between two columns of nodes: per axis its first value and its step per pixel."""
        piece = SimpleNamespace(
            valid  = Signal(),
            take   = Signal(),
            folded = Signal(), # The nodes of a camera, one above the other.
            starts = [Signal(EDGE_BITS) for _ in edges],
            steps  = [Signal(EDGE_BITS + 1) for _ in edges],
        )
        before        = [Signal(EDGE_BITS) for _ in edges]
        folded        = Signal() # Of this column of nodes,
        folded_before = Signal() # and of the one before.
        self.comb += [
            walk.hold.eq((walk.node != 0) & piece.valid & ~piece.take),
            # Rows fold, columns of nodes do not: edges alternate between column and row.
            folded.eq(Cat(*[fold for _, fold in edges[1::2]]) != 0),
        ]
        self.sync += [
            If(piece.take,
                piece.valid.eq(0)
            ),
            If(walk.step,
                folded_before.eq(folded),
                [old.eq(edge) for old, (edge, _) in zip(before, edges)],
                If(walk.node != 0,
                    piece.valid.eq(1),
                    piece.folded.eq(folded | folded_before),
                    [start.eq(old) for start, old in zip(piece.starts, before)],
                    [step.eq(sign_extended(edge, EDGE_BITS + 1) - sign_extended(old, EDGE_BITS + 1))
                        for step, old, (edge, _) in zip(piece.steps, before, edges)]
                )
            ),
        ]
        return piece

    def add_pixels(self, limits, piece):
        """Add up the steps of each piece, and add the pixel's own place; return whether a piece is under way."""
        source      = self.source
        active      = Signal()
        advance     = Signal()
        piece_ends  = Signal()
        place       = Signal(STEP_BITS)           # Column in the piece.
        column      = Signal.like(limits.column)
        row         = Signal.like(limits.row)
        last_column = Signal()
        folded      = Signal()
        self.comb += [
            advance.eq(active & (~source.valid | source.ready)),
            last_column.eq(column == limits.column),
            piece_ends.eq((place == 2**STEP_BITS - 1) | last_column),
            piece.take.eq(piece.valid & (~active | (advance & piece_ends))),
        ]
        self.sync += [
            If(source.ready,
                source.valid.eq(0)
            ),
            If(advance,
                source.valid.eq(1),
                source.first.eq((column == 0) & (row == 0)),
                source.last.eq(last_column & (row == limits.row)),
                source.folded.eq(folded),
                place.eq(place + 1),
                column.eq(column + 1),
                If(piece_ends,
                    active.eq(0)
                ),
                If(last_column,
                    column.eq(0),
                    row.eq(row + 1)
                )
            ),
            If(piece.take,
                active.eq(1),
                place.eq(0),
                folded.eq(piece.folded | self.folded_columns(piece))
            ),
            If(self.begin,
                column.eq(0),
                row.eq(0)
            ),
        ]
        names = [(camera, axis) for camera in CAMERAS for axis in ("column", "row")]
        for (camera, axis), start, step in zip(names, piece.starts, piece.steps):
            self.add_axis(f"{camera}_{axis}", column if axis == "column" else row, advance, piece.take, start, step)
        return active

    def folded_columns(self, piece):
        """Return whether positions along a piece do not go to the right, in either camera."""
        gaps = []
        for step in piece.steps[::2]:
            gap = Signal(EDGE_BITS + 2)
            self.comb += gap.eq(sign_extended(step, EDGE_BITS + 2) + FOLD_COLUMN)
            gaps.append(gap[-1] | (gap == 0))
        return gaps[0] | gaps[1]

    def add_axis(self, name, own, advance, take, start, step):
        """Make the column or the row of a camera's position."""
        bits  = self.parameters.position_bits
        value = Signal(VALUE_BITS)
        held  = Signal(VALUE_BITS) # Step of the piece under way.
        self.sync += [
            If(advance,
                value.eq(value + held),
                getattr(self.source, name).eq(own + sign_extended(value[DROPPED_BITS + FRACTION_BITS:], bits)),
                getattr(self.source, f"{name}_fraction").eq(value[DROPPED_BITS:])
            ),
            If(take,
                value.eq(Cat(Replicate(0, STEP_BITS), start)),
                held.eq(sign_extended(step, VALUE_BITS))
            ),
        ]
