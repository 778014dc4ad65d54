#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matcher: the winners' FIFO has room for every result in flight."""

from __future__ import annotations

from migen import Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.matcher.matcher import Matcher

from .proof import Proof, inside
from .streams import feed, sound, taken

#: Features with stages of at most five clocks: longer ones delay `valid` in the same way, and slow down the induction.
FEATURES = {"raw", "left_right", "min_disparity"}

SMALL = MatcherParameters(max_width=32, max_height=15, disparities=16, max_block_size=5, features=FEATURES)


def matcher(make=Matcher) -> Proof:
    """Prove frames of any settings, and resets at any time; the receiver accepts the map at any time."""
    core  = make(SMALL)
    proof = Proof(core)
    feed(proof, core.sink)
    proof.free(core.source.ready, core.reset, *(getattr(core, name) for name in
               ("width", "height", "disparities", "min_disparity", "block_size")))
    fifo = core.fifo

    def later(event) -> Signal:
        """Return a Signal of a clock ago, cleared by a reset."""
        before = Signal()
        proof.sync += before.eq(event & ~core.reset)
        return before

    def parts(stages) -> list:
        """Return the stages, with the engine as its parts."""
        return [part for stage in stages for part in (stage.pipeline() if stage is core.engine else [stage])]

    # Results in flight: one for each complete step of the raster, until it is in the FIFO.
    source = core.raster.source
    under  = [source.valid & source.complete]
    proof.assume("a result has a cost, as Raster is proven", ~under[0] | source.cost)
    for stage in parts(core.pipeline()[1:]):
        for _ in range(stage.latency):
            under.append(later(under[-1]))
        # After the last stage each valid item is a result.
        complete, cost = (1, 1) if stage is core.selection else (stage.source.complete, stage.source.cost)
        result = stage.source.valid & complete
        proof.prove(f"{type(stage).__name__} passes each on, once", (result == under[-1]) & (~result | cost))
    inside_now = Signal(8)
    proof.comb += inside_now.eq(fifo.level + sum(under[1:], start=0))
    proof.prove("there is room for all that are under way", inside_now <= fifo.depth)
    proof.prove("the FIFO takes each", ~fifo.sink.valid | fifo.sink.ready)
    proof.prove("each comes from the pipeline", fifo.sink.valid == under[-1])
    proof.reach("a result comes out", taken(fifo.source))

    # Invariants, for the induction.
    step  = inside(core.raster, "step")[0]
    used  = max(inside(core, "used"), key=len)
    coming, shown = later(step), Signal()
    total = Signal(8)
    proof.comb += [shown.eq(source.valid), total.eq(used + coming + shown + core.raster.credit)]
    sound(proof, fifo)
    proof.prove("a step is shown two clocks later", source.valid == later(coming))
    proof.prove("used counts them", used == inside_now)
    proof.prove("credit is for what has room", total <= fifo.depth)
    return proof
