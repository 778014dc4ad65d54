#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Border, Median and LeftRight: from winners to the map without loss."""

from __future__ import annotations

from litex.gen import LiteXModule
from migen import If, Mux, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.post.border import Border
from litestereo.gateware.post.left_right.left_right import LeftRight
from litestereo.gateware.post.median import PIPELINE_CLOCKS, Median

from .proof import Proof, inside
from .streams import feed, raster_position, sound, stays, taken

SMALL = MatcherParameters(max_width=32, max_height=15, disparities=16, max_block_size=7)

#: Clocks until the values that a core derives from its settings are valid.
SETTLE = 4


def settings(proof: Proof, core: LiteXModule, *names: str) -> tuple[dict[str, Signal], Signal]:
    """Return legal settings that the solver chooses for each frame, and whether the core has had time to settle."""
    values = {name: proof.constant(len(getattr(core, name))) for name in names}
    proof.comb += [getattr(core, name).eq(value) for name, value in values.items()]
    for name, most in [("width", SMALL.max_width), ("height", SMALL.max_height)]:
        if name in values:
            proof.assume(f"the {name} is legal", (values[name] != 0) & (values[name] <= most))
    clocks  = Signal(max=SETTLE + 1)
    settled = Signal()
    proof.comb += settled.eq(clocks == SETTLE)
    proof.sync += If(~settled, clocks.eq(clocks + 1))
    proof.free(core.begin, core.source.ready)
    proof.assume("a frame begins when the core has settled", ~core.begin | settled)
    return values, settled


def border(make=Border) -> Proof:
    """Prove frames of all sizes, one after the other."""
    core  = make(SMALL)
    proof = Proof(core)
    feed(proof, core.sink)
    values, settled = settings(proof, core, "width", "height", "disparities", "min_disparity", "block_size")
    width, height   = values["width"], values["height"]
    block_size      = values["block_size"]
    # Each sum is a Signal: in Verilog a sum is as wide as what it is compared with.
    smallest = Signal(12)
    begins   = Signal(12)
    proof.comb += [
        smallest.eq(values["min_disparity"] + values["disparities"] + block_size - 1),
        begins.eq(values["min_disparity"] + values["disparities"] - 1 + block_size[1:]),
    ]
    proof.assume("a frame begins when none is under way", ~core.begin | ~core.busy)
    proof.assume("block size and disparities are legal",
                 block_size[0] & (block_size >= 5) & (block_size <= SMALL.max_block_size)
                 & (values["disparities"] == SMALL.disparities) & (height >= block_size)
                 & (width >= smallest))

    # Reference position of the pixel.
    moves       = taken(core.source)
    column, row = raster_position(proof, moves, width, core.begin)
    last        = (column == width - 1) & (row == height - 1)
    margin = block_size[1:]
    ends   = [Signal(8, name=f"end_{axis}") for axis in "xy"]
    valid   = Signal()
    invalid = Signal(16)
    shown   = Signal(16)
    proof.comb += [
        ends[0].eq(width - margin),
        ends[1].eq(height - margin),
        valid.eq((column >= begins) & (column < ends[0]) & (row >= margin) & (row < ends[1])),
        invalid.eq((values["min_disparity"] << 4) - 16),
        shown.eq((values["min_disparity"] << 4) + core.sink.disparity),
    ]
    offered = core.source.valid
    proof.prove("what is offered stays", stays(proof, core.source))
    proof.prove("nothing outside of a frame", ~offered | core.busy)
    proof.prove("first is the first pixel", ~offered | (core.source.first == ((column == 0) & (row == 0))))
    proof.prove("last is pixel width*height - 1", ~offered | (core.source.last == last))
    proof.prove("a frame ends with it", ~core.busy | ~proof.past(moves & core.source.last) | proof.past(core.begin))
    proof.prove("a winner for each pixel of the valid region, and for no other", taken(core.sink) == (moves & valid))
    proof.prove("pixels are winners or invalid", ~offered | (core.source.disparity == Mux(valid & core.sink.found,
                                                                                         shown, invalid)))
    proof.reach("a row", core.busy & (row == 1))
    # Invariants, for the induction.
    own = [inside(core, name)[0] for name in ("column", "row")]
    proof.prove("columns and rows are counted", ~core.busy | ((own[0] == column) & (own[1] == row)
                                                              & (column < width) & (row < height)))
    proof.prove("settled", ~core.busy | settled)
    return proof


def median(make=Median) -> Proof:
    """Prove that the median's FIFO has room for all results in flight."""
    core  = make(SMALL)
    proof = Proof(core)
    feed(proof, core.sink)
    settings(proof, core, "width", "height", "median")
    proof.assume("a frame begins when none is under way", ~core.begin | ~core.busy)
    proof.reach("a result gets through", core.median & taken(core.source))
    bounded(proof, core, inside(core, "gives")[0], PIPELINE_CLOCKS)
    return proof


def left_right(make=LeftRight) -> Proof:
    """Prove that the FIFO of the left-right check has room for all results in flight."""
    core  = make(SMALL)
    proof = Proof(core)
    feed(proof, core.sink)
    proof.free(core.disp12_max_diff, core.outer)
    settings(proof, core, "width", "disparities", "min_disparity", "left_right")
    fifo = core.fifo
    proof.reach("a winner gets through", core.left_right & taken(core.source))
    proof.prove("the FIFO has room", ~fifo.sink.valid | fifo.sink.ready)
    proof.prove("what is offered stays", stays(proof, core.source))
    sound(proof, fifo)
    return proof


def bounded(proof: Proof, core: LiteXModule, issued: Signal, latency: int) -> None:
    """Prove that each issued result leaves the core's FIFO once, and finds room in it."""
    fifo  = core.fifo
    under = [issued]
    for _ in range(latency):
        under.append(proof.past(under[-1]))
    proof.prove("results reach the FIFO", fifo.sink.valid == under[-1])
    proof.prove("the FIFO has room", ~fifo.sink.valid | fifo.sink.ready)
    proof.prove("what is offered stays", stays(proof, core.source))
    sound(proof, fifo)
    balance = Signal(8)
    proof.sync += balance.eq(balance + issued - taken(fifo.source))
    proof.prove("none is lost, none comes twice", balance == fifo.level + sum(under[1:], start=0))
