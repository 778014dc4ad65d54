#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""LineBuffer: its ring stays within the memory, and returns the pair block_size rows above."""

from __future__ import annotations

from migen import Cat, If, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.matcher.line_buffer import LineBuffer

from .proof import Proof, inside

SMALL = MatcherParameters(max_width=32, max_height=15, disparities=16, max_block_size=7)


def line_buffer(make=LineBuffer, most_columns: int = SMALL.max_width, contents: bool = False) -> Proof:
    """Prove frames of any size in raster order, with gaps, and with steps that are not pixels.

    With `contents`, each pair is also followed through the memory, for as many clocks as are checked.
    """
    core  = make(SMALL)
    proof = Proof(core)
    sink  = core.sink
    proof.free(sink.valid, sink.pixel, sink.left, sink.right)
    width      = proof.constant(6)
    block_size = proof.constant(len(core.block_size))
    proof.comb += core.block_size.eq(block_size)
    proof.assume("the width is legal", (width != 0) & (width <= most_columns))
    proof.assume("the block size is legal", block_size[0] & (block_size >= 5) & (block_size <= SMALL.max_block_size))
    # The threshold follows the block size a clock later.
    proof.assume("the first step comes when the core has settled", proof.started | ~sink.valid)

    # Raster: columns, rows, and rows modulo block_size.
    step = sink.valid & sink.pixel
    column = Signal(6)
    row    = Signal(6)
    ring   = Signal(6)
    last   = Signal()
    proof.comb += [
        last.eq(column == width - 1),
        sink.pixel_first.eq(column == 0),
        sink.pixel_last.eq(last),
        sink.row_first.eq(row == 0),
    ]
    proof.sync += If(step,
        column.eq(column + 1),
        If(last,
            column.eq(0),
            row.eq(row + 1),
            ring.eq(ring + 1),
            If(ring == block_size - 1,
                ring.eq(0)
            )
        )
    )
    proof.assume("a frame has less than 63 rows", row < 63)

    depth   = SMALL.max_width*SMALL.max_block_size
    current = inside(core, "current")[0]
    place   = Signal(12)
    size    = Signal(12)
    proof.comb += [place.eq(ring*width + column), size.eq(width*block_size)]
    proof.prove("the address stays within block_size rows", ~step | (current < size))
    proof.prove("the address stays within the memory", ~step | (current < depth))
    proof.prove("each place is used again block_size rows later", ~step | (current == place))
    proof.reach("the ring is full", row == 6)
    # Invariants, for the induction.
    proof.prove("the ring's row", inside(core, "ring_row")[0] == ring)
    proof.prove("the first row is the ring's first", (row != 0) | (ring == 0))
    proof.prove("the row is in the ring, the column in the row", (ring < block_size) & (column < width))
    proof.prove("the address goes on", (row == 0) & (column == 0) | (inside(core, "address")[0] == place))
    proof.prove("the threshold is right", ~proof.started | (inside(core, "last_row")[0] == block_size - 1))
    proof.prove("nothing comes before that", proof.started | (row == 0) & (column == 0))
    if contents:
        above, across = [proof.constant(6) for _ in range(2)]
        pair  = proof.constant(2*len(sink.left))
        below = Signal(8)
        here  = Signal()
        proof.comb += [
            below.eq(above + block_size),
            here.eq(step & (row == below) & (column == across)),
        ]
        proof.assume("the pair above", ~step | (row != above) | (column != across)
                     | (Cat(sink.left, sink.right) == pair))
        out   = proof.past(proof.past(here))
        proof.prove("it comes out block_size rows below",
                    ~out | (Cat(core.source.left_old, core.source.right_old) == pair))
        proof.reach("it does", out)
    return proof
