#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""RowWindow and RowRing: rows are counted right, a row that is gone is told, no read meets a word that is written.

With as many rows in the ring as a map needs none is ever gone; with two rows fewer one is, and that is told.
"""

from __future__ import annotations

from types import SimpleNamespace

from migen import If, Mux, Signal

from litestereo.gateware.rectification.layouts import CAMERAS
from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.row_ring import RowRing
from litestereo.gateware.rectification.row_window import RowWindow
from litestereo.soc.flow.mapping import with_garbage

from .proof import Proof, inside
from .streams import feed, taken

SMALL = RectifierParameters(max_width=17, max_height=9, rows=6)

#: A ring of three columns: the arithmetic is the same, and the solver is faster.
NARROW = SimpleNamespace(max_width=3, rows=6, bank_columns=2, bank_words=6, position_bits=4, track_bits=3)

#: Clocks until the limits are valid.
SETTLE = 3


def _before(proof: Proof, signal, clocks: int) -> Signal:
    """Return a signal, or a condition, as it was some clocks ago."""
    if not isinstance(signal, Signal):
        condition = Signal()
        proof.comb += condition.eq(signal)
        signal = condition
    for _ in range(clocks):
        signal = proof.past(signal)
    return signal


def row_window(make=RowWindow, missing: int | None = None) -> Proof:
    """Prove counts, tracks and marks of positions of any kind, for frames of any size, one after the other.

    With `missing` the positions are those of maps that need so many rows more than the ring has, 0: as many.
    """
    core  = make(SMALL)
    proof = Proof(core)
    rows  = SMALL.rows
    feed(proof, core.raw)
    feed(proof, core.sink)
    proof.free(core.begin, core.credit)
    width, height, lead = (proof.constant(len(signal)) for signal in (core.width, core.height, core.lead))
    proof.comb += [core.width.eq(width), core.height.eq(height), core.lead.eq(lead)]
    proof.assume("the size is legal", (width >= 2) & (width <= SMALL.max_width) & (height >= 2)
                 & (height <= SMALL.max_height) & (lead < rows))
    clocks = Signal(max=SETTLE + 1)
    proof.sync += If(clocks != SETTLE, clocks.eq(clocks + 1))
    proof.assume("a frame begins when its limits are valid, and none is written",
                 ~core.begin | ((clocks == SETTLE) & ~core.writing))
    proof.assume("positions come from then on", ~core.sink.valid | (clocks == SETTLE))
    counts, limits, position = core.counts, core.limits, core.position

    # Reference: where the next pair belongs; rows that are complete since the first one of the frame that is read.
    moves = taken(core.raw)
    column     = Signal(6)
    row        = Signal(6)
    ring       = Signal(4)
    whole      = Signal(6)
    row_ends   = Signal()
    frame_ends = Signal()
    proof.comb += [
        row_ends.eq(moves & (column == width - 1)),
        frame_ends.eq(core.ending & (whole >= height)),
    ]
    proof.sync += [
        If(moves,
            column.eq(column + 1)
        ),
        If(row_ends,
            column.eq(0),
            row.eq(row + 1),
            ring.eq(Mux(ring == rows - 1, 0, ring + 1))
        ),
        If(core.begin,
            row.eq(0)
        ),
        whole.eq(whole + row_ends - Mux(frame_ends, height, 0)),
    ]
    proof.prove("complete rows are counted", counts.written == whole)
    proof.prove("rows fill the tracks in order", counts.track == ring)
    proof.prove("a row comes in up to `lead` rows before it is needed",
                ~moves | (column != 0) | (whole < counts.needed + lead))
    proof.prove("no pair beyond the frame", ~core.raw.ready | (core.writing & (row < height) & (column < width)))
    proof.prove("each pair is written two clocks later", core.write.valid == _before(proof, moves, 2))
    proof.prove("into its place", ~core.write.valid | ((core.write.track == _before(proof, ring, 2))
                & (core.write.column == _before(proof, column, 2))
                & (core.write.left == _before(proof, core.raw.left, 2))
                & (core.write.right == _before(proof, core.raw.right, 2))))
    proof.prove("each position leaves two clocks later", core.source.valid == _before(proof, core.taken, 2))
    proof.prove("with credit, and not between two frames", ~core.taken | (core.credit & ~core.ending))

    # Each camera: what a position needs, from its definition.
    needs     = [_camera(proof, core, camera, whole, ring, width, height) for camera in CAMERAS]
    some_gone = needs[0].gone | needs[1].gone
    proof.prove("a row that is gone is told", ~core.source.valid
                | (core.source.row_gone == _before(proof, some_gone, 2)))
    newest = _newest(proof, core, needs, frame_ends)
    if missing is not None:
        span = proof.constant(4)
        proof.assume("positions are of a map that needs the rows of the ring, and those that are missing",
                     span + lead + 1 == rows + missing)
        proof.assume("no row is older than that", ~position.valid
                     | ((~needs[0].used | (needs[0].first + span >= newest))
                        & (~needs[1].used | (needs[1].first + span >= newest))))
    if missing == 0:
        proof.prove("with enough rows none is gone", ~core.source.valid | ~core.source.row_gone)
        proof.prove("none that a position is about to read", ~core.taken | ~some_gone)
        proof.reach("a row is the last that the ring holds", core.taken & needs[0].used
                    & (needs[0].first + rows == whole + 1))
    else:
        proof.reach("a row is gone", core.source.valid & core.source.row_gone)
    proof.reach("a frame ends while the next one comes in", frame_ends & core.writing & (row == 1))

    # Invariants, for the induction.
    proof.prove("limits are right", (clocks != SETTLE) | ((limits.column == width - 1) & (limits.row == height - 1)))
    proof.prove("nothing comes before that", (clocks == SETTLE) | ~(
        core.writing | core.ending | core.inside.valid | position.valid | (counts.written != 0) | (column != 0)))
    proof.prove("rows that may come in are no more than that", counts.limit <= counts.needed + lead)
    proof.prove("the frame has all rows that are needed", (counts.needed <= height)
                & (~core.ending | (counts.needed == height)))
    proof.prove("no more rows are complete", whole <= counts.needed + lead)
    proof.prove("a row under way may come in", (column == 0) | (core.writing & (whole < counts.needed + lead)))
    proof.prove("columns and rows are counted", (inside(core, "column")[0] == column) & (column < width)
                & (~core.writing | ((inside(core, "row")[0] == row) & (row < height))) & (ring < rows))
    return proof


def _newest(proof: Proof, core: RowWindow, needs: list[SimpleNamespace], frame_ends: Signal) -> Signal:
    """Prove the count of needed rows; return it with those of the position that waits, for the position's frame."""
    position = core.position
    need     = Signal(6)
    seen     = Signal(6)
    newest   = Signal(6)
    counts   = [Mux(one.used, one.count, 0) for one in needs]
    proof.comb += [
        need.eq(Mux(counts[0] > counts[1], *counts)),
        # Between two frames the position is one of the next frame.
        newest.eq(Mux(core.ending | (need > seen), need, seen)),
    ]
    proof.sync += [
        If(position.valid & ~core.ending,
            seen.eq(newest)
        ),
        If(frame_ends,
            seen.eq(0)
        ),
    ]
    proof.prove("a position needs no more than its cameras", ~position.valid | (position.needed == need))
    proof.prove("needed rows are counted", core.ending | (core.counts.needed == seen))
    return newest


def _camera(proof: Proof, core: RowWindow, camera: str, whole: Signal, ring: Signal, width: Signal, height: Signal
            ) -> SimpleNamespace:
    """Prove that a camera's position is read where its rows are.

    Return whether the camera has a pixel there, the first row of it, the count up to the last one, and whether one of
    them is gone.
    """
    rows, bits = SMALL.rows, SMALL.position_bits
    known      = {}
    for name, stage in (("inside", core.inside), ("position", core.position)):
        # A place outside of the image on the left or above it is a large number.
        places = []
        for axis, size in (("column", width), ("row", height)):
            first  = Signal(bits)
            second = Signal(bits)
            proof.comb += [first.eq(getattr(stage, f"{camera}_{axis}")), second.eq(first + 1)]
            places.append((first < size, second < size))
        (left, right), (upper, lower) = places
        known[name] = (left, right, upper, lower)
        columns, marks = getattr(stage, f"{camera}_columns_inside"), getattr(stage, f"{camera}_rows_inside")
        proof.prove(f"{camera}, {name}: neighbours in the image", ~stage.valid | (
            (columns[0] == left) & (columns[1] == right) & (marks[0] == upper) & (marks[1] == lower)))
    left, right, upper, lower = known["position"]
    used  = Signal()
    first = Signal(6) # The first row that is needed,
    count = Signal(6) # and the count of rows up to the last one.
    gone  = Signal()
    place = getattr(core.position, f"{camera}_row")
    proof.comb += [
        used.eq((left | right) & (upper | lower)),
        first.eq(Mux(upper, place, 0)),
        count.eq(Mux(lower, Mux(upper, place + 2, 1), place + 1)),
        gone.eq(used & (first + rows <= whole)),
    ]
    proof.prove(f"{camera}: it waits for its rows", ~core.taken | ~used | (count <= whole))
    proof.prove(f"{camera}: what it needs", ~core.position.valid | (
        (getattr(core.position, f"{camera}_used") == used)
        & (~used | ((getattr(core.position, f"{camera}_gone") == first + rows) & (core.position.needed >= count)))))
    proof.prove(f"{camera}: it needs no row beyond the image", ~core.position.valid | (core.position.needed <= height))

    # Two clocks later: the track is as far behind the row under way as the row is.
    source    = core.source
    track     = getattr(source, f"{camera}_track")
    marks     = getattr(source, f"{camera}_rows_inside")
    there     = Signal()
    distance  = Signal(6)
    then      = Signal(6)
    under_way = Signal(8) # Or as many more as there are tracks.
    now       = _before(proof, ring, 2)
    following = Signal(4)
    proof.comb += [
        there.eq(_before(proof, used & ~gone, 2)),
        distance.eq(whole - place),
        then.eq(_before(proof, distance, 2)),
        under_way.eq(track + then),
        following.eq(Mux(track == rows - 1, 0, track + 1)),
    ]
    proof.prove(f"{camera}: rows that are there count, others do not", ~source.valid | (
        (marks[0] == (there & _before(proof, upper, 2))) & (marks[1] == (there & _before(proof, lower, 2)))))
    proof.prove(f"{camera}: the track is that of the row",
                ~source.valid | ~there | (under_way == now) | (under_way == now + rows))
    proof.prove(f"{camera}: the track is in the ring", ~source.valid | (track < rows))
    meets = source.valid & core.write.valid & (
        (marks[0] & (core.write.track == track)) | (marks[1] & (core.write.track == following)))
    proof.prove(f"{camera}: no read meets a row that is written", ~meets)
    return SimpleNamespace(used=used, first=first, count=count, gone=gone)


class WithGarbage(Proof):
    """A proof in whose memories a read of a word that is being written gives garbage."""

    def core_verilog(self) -> str:
        """Return the Verilog of the core."""
        return with_garbage(super().core_verilog())


def row_ring(make=RowRing) -> Proof:
    """Prove that a read gives what was written last, and meets no write, for as many clocks as are checked."""
    core  = make(NARROW)
    proof = WithGarbage(core)
    write, sink = core.write, core.sink
    proof.free(write.valid, sink.valid, *write.payload.flatten(), *sink.payload.flatten())
    proof.assume("tracks and columns are in the ring", (write.track < NARROW.rows) & (sink.track < NARROW.rows)
                 & (write.column < NARROW.max_width))
    column    = Signal(NARROW.position_bits)
    following = Signal(NARROW.position_bits)
    below     = Signal(4)
    proof.comb += [
        column.eq(sink.column),
        following.eq(sink.column + 1),
        below.eq(Mux(sink.track == NARROW.rows - 1, 0, sink.track + 1)),
    ]
    proof.assume("columns that count are in the row", (~sink.columns_inside[0] | (column < NARROW.max_width))
                 & (~sink.columns_inside[1] | (following < NARROW.max_width)))
    # A place that the solver chooses, and what it holds for positions of this clock.
    track, across = proof.constant(3), proof.constant(4)
    value = Signal(8)
    known = Signal()
    here  = write.valid & (write.track == track) & (write.column == across)
    proof.sync += If(here, value.eq(write.pixel), known.eq(1))
    for row, row_track in enumerate((sink.track, below)):
        for side, place in enumerate((column, following)):
            counts = sink.rows_inside[row] & sink.columns_inside[side]
            reads  = Signal()
            proof.comb += reads.eq(sink.valid & counts & (row_track == track) & (place == across))
            pixel  = getattr(core.source, f"p{row}{side}")
            proof.assume(f"p{row}{side}: a read does not meet a write", ~reads | ~here)
            proof.prove(f"p{row}{side} is what was written last", ~_before(proof, reads & known, core.latency)
                        | (pixel == _before(proof, value, core.latency)))
            proof.prove(f"p{row}{side} is 0 outside", ~_before(proof, sink.valid & ~counts, core.latency)
                        | (pixel == 0))
            if row and side:
                proof.reach("a pixel is read", _before(proof, reads & known, core.latency) & (pixel == 77))
    for name in ("address", "bases"):
        for signal in inside(core, name):
            proof.prove(f"{name} {signal.duid} is in the bank", signal < NARROW.bank_words)
    return proof
