#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Raster: width x height pairs are accepted, each with credit, and none outside of a frame."""

from __future__ import annotations

from migen import If, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.matcher.raster import Raster

from .proof import Proof, inside
from .streams import feed, raster_position, taken

SMALL = MatcherParameters(max_width=32, max_height=15, disparities=16, max_block_size=7)

#: Clocks until the thresholds are valid.
SETTLE = 4


def raster(make=Raster) -> Proof:
    """Prove frames of all sizes; credit comes and goes."""
    core  = make(SMALL)
    proof = Proof(core)
    feed(proof, core.sink)
    proof.free(core.begin, core.credit)
    names  = ["width", "height", "disparities", "min_disparity", "block_size"]
    values = {name: proof.constant(len(getattr(core, name))) for name in names}
    proof.comb += [getattr(core, name).eq(value) for name, value in values.items()]
    width, height = values["width"], values["height"]
    proof.assume("width and height are legal", (width >= 2) & (width <= SMALL.max_width) & (height >= 2)
                 & (height <= SMALL.max_height))
    proof.assume("a block has a pixel", values["block_size"] != 0)
    clocks = Signal(max=SETTLE + 1)
    proof.sync += If(clocks != SETTLE, clocks.eq(clocks + 1))
    running = inside(core, "running")[0]
    proof.assume("a frame begins when none is under way and the core has settled",
                 ~core.begin | (~running & (clocks == SETTLE)))

    # Reference count of pairs.
    moves       = taken(core.sink)
    column, row = raster_position(proof, moves, width, core.begin)
    step = inside(core, "step")[0]
    proof.prove("a step, and a pair, only with credit", (~step | core.credit) & (~core.sink.ready | core.credit))
    proof.prove("no pair outside of a frame", ~core.sink.ready | running)
    proof.prove("a pair is taken with a step", ~moves | step)
    proof.prove("no pair beyond the frame", ~core.sink.ready | (row < height))
    proof.prove("a frame ends when all have been taken", ~proof.past(running) | running | (row == height))
    proof.prove("each step comes out two clocks later", core.source.valid == proof.past(proof.past(step)))
    proof.prove("a pair is marked as one", proof.past(proof.past(moves)) == (core.source.valid & core.source.take))
    proof.prove("a result has a cost", ~(core.source.valid & core.source.complete) | core.source.cost)
    proof.reach("a row is taken", row == 1)
    # Invariants, for the induction.
    limits = core.thresholds
    step_index, own_row, row_takes, column_takes = (
        inside(core, name)[0] for name in ("step_index", "row", "row_takes", "column_takes"))
    proof.prove("thresholds are right", (clocks != SETTLE) | (
        (limits.take_last == width - 1) & (limits.take_last_row == height - 1)
        & (limits.step_last == width - 1 + SMALL.ahead) & (limits.row_last == height - 1 + SMALL.ahead)))
    first = limits.cost_first
    sums  = [Signal(12) for _ in range(3)]
    proof.comb += [total.eq(value) for total, value in zip(sums, (
        values["disparities"] + values["min_disparity"] + SMALL.ahead - 1, first + values["block_size"] - 1,
        values["block_size"] + SMALL.ahead - 1), strict=True)]
    proof.prove("so are those of a result", (clocks != SETTLE) | (
        (first == sums[0]) & (limits.complete == sums[1]) & (limits.row_complete == sums[2])))
    proof.prove("settled", ~running | (clocks == SETTLE))
    proof.prove("the step is in the row", ~running | ((step_index <= limits.step_last) & (own_row <= limits.row_last)))
    proof.prove("pairs come in the row's first steps", ~running | (column_takes == (step_index < width)))
    proof.prove("and the frame's first rows", ~running | (row_takes == (own_row < height)))
    ended = row_takes & ~column_takes
    proof.prove("the column is the step", ~running | ~row_takes | ended | ((column == step_index) & (row == own_row)))
    proof.prove("then the next row's first", ~running | ~ended | ((column == 0) & (row == own_row + 1)))
    proof.prove("after the last row none", ~running | row_takes | ((column == 0) & (row == height)))
    return proof
