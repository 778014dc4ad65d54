#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from types import SimpleNamespace

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .layouts import *

# Row Window ---------------------------------------------------------------------------------------

@ResetInserter()
class RowWindow(LiteXModule):
    """Which rows of the raw images are in the rings, when a row may come in, and when a position may be read.

    Both rings hold the same rows: pairs come in together, and positions leave together. Rows are counted from the first
    one of the frame whose positions are read:

        written    rows that are complete; the next one may be under way; rows of the next frame follow
        needed     rows that the positions of this frame have needed so far: the lowest neighbour's row, plus 1

    - A row may come in while `written` < `needed` + `lead`. So the source is stopped `lead` rows ahead of the newest
      row that was needed, and never waits for a row that must come first.
    - A position waits until its rows are complete: `written` >= its rows.
    - Row r is gone when `written` > r + rows - 1: then its track is that of the row under way, or has been since. The
      pixel is 0, as outside of the image, and ``row_gone`` is set. With enough rows in the ring that never happens.
    - Neighbours outside of the image need no row. A position without any neighbour inside neither waits nor is gone.
    - After a frame's last position its remaining rows come in; then the count goes on with the next frame's.

    `write` and `source` come out after the same number of clocks, so a position of the clock in which a pixel came in
    is read before that pixel is written.
    """
    def __init__(self, parameters):
        self.raw    = stream.Endpoint(pixel_pair_layout())                # Raw pairs, raster order.
        self.sink   = stream.Endpoint(source_position_layout(parameters)) # Positions, raster order; first and last.
        self.write  = stream.Endpoint(pair_write_layout(parameters))      # Pipeline: pairs for the rings.
        self.source = stream.Endpoint(pair_position_layout(parameters))   # Pipeline: positions in the rings.

        self.width   = Signal(max=parameters.max_width + 1)  # Columns of the frame.
        self.height  = Signal(max=parameters.max_height + 1) # Rows of the frame.
        self.lead    = Signal(max=parameters.rows)           # Rows that may come in before they are needed.
        self.begin   = Signal()                              # Raw pairs of a frame follow (pulse, while not writing).
        self.credit  = Signal()                              # One more position has room.
        self.writing = Signal()                              # Raw pairs of a frame are missing.
        self.ending  = Signal()                              # All positions of a frame have left, not all its rows.
        self.taken   = Signal()                              # A position leaves (pulse).
        self.latency = None                                  # Positions wait; then two clocks.

        # # #

        self.parameters = parameters
        self.limits   = self.add_limits()
        self.counts   = self.add_counts()
        self.inside   = stream.Endpoint(source_position_layout(parameters) + inside_layout())
        self.position = stream.Endpoint(judged_position_layout(parameters))
        self.add_rows(self.limits, self.counts)
        self.add_judgement(self.limits, self.inside, self.position)
        self.add_frame(self.position, self.counts)
        self.add_tracks(self.position, self.counts)

    def add_limits(self):
        """Register what depends on the size: last column and row."""
        limits = SimpleNamespace(column=Signal.like(self.width), row=Signal.like(self.height))
        self.sync += [
            limits.column.eq(self.width - 1),
            limits.row.eq(self.height - 1),
        ]
        return limits

    def add_counts(self):
        """Return counts of rows, the track of the row under way, and what changes them."""
        bits = self.parameters.count_bits
        return SimpleNamespace(
            written = Signal(bits),
            needed  = Signal(bits),
            limit   = Signal(bits),                       # `needed` + `lead`, a clock later.
            track   = Signal(self.parameters.track_bits),
            row     = Signal(),                           # A row is complete (pulse).
            frame   = Signal(),                           # So are all of a frame, and its positions have left (pulse).
        )

    # Rows -----------------------------------------------------------------------------------------

    def add_rows(self, limits, counts):
        """Accept the pairs of a frame row by row, and put them into the track under way."""
        raw, write  = self.raw, self.write
        column      = Signal.like(limits.column)
        row         = Signal.like(limits.row)
        moves       = Signal()
        last_column = Signal()
        self.comb += [
            raw.ready.eq(self.writing & ((column != 0) | (counts.written < counts.limit))),
            moves.eq(raw.valid & raw.ready),
            last_column.eq(column == limits.column),
            counts.row.eq(moves & last_column),
        ]
        self.sync += [
            If(moves,
                column.eq(column + 1)
            ),
            If(counts.row,
                column.eq(0),
                row.eq(row + 1),
                counts.track.eq(counts.track + 1),
                If(counts.track == self.parameters.rows - 1,
                    counts.track.eq(0)
                ),
                If(row == limits.row,
                    self.writing.eq(0)
                )
            ),
            If(self.begin,
                self.writing.eq(1),
                row.eq(0)
            ),
        ]
        self.comb += [
            write.valid.eq(delayed(self, moves, 2)),
            write.track.eq(delayed(self, counts.track, 2)),
            write.column.eq(delayed(self, column, 2)),
            write.left.eq(delayed(self, raw.left, 2)),
            write.right.eq(delayed(self, raw.right, 2)),
        ]

    # Positions ------------------------------------------------------------------------------------

    def add_judgement(self, limits, inside, position):
        """Find out which neighbours of a position are inside of the image, then which rows that takes."""
        sink = self.sink
        bits = self.parameters.position_bits
        move = Signal()
        self.comb += [
            move.eq(~position.valid | self.taken),
            sink.ready.eq(move),
        ]
        names = [name for name, *_ in sink.description.payload_layout]
        steps = [(sink, inside, names), (inside, position, [name for name, *_ in inside.description.payload_layout])]
        for before, after, fields in steps:
            self.sync += If(move,
                after.valid.eq(before.valid),
                after.first.eq(before.first),
                after.last.eq(before.last),
                [getattr(after, name).eq(getattr(before, name)) for name in fields]
            )
        needs = []
        for camera in CAMERAS:
            for axis, limit in (("column", limits.column), ("row", limits.row)):
                here, following = getattr(sink, f"{camera}_{axis}"), Signal(bits)
                # A place left of or above the image is a large number, as these are without sign.
                self.comb += following.eq(here + 1)
                self.sync += If(move,
                    getattr(inside, f"{camera}_{axis}s_inside").eq(Cat(here <= limit, following <= limit))
                )
            needs.append(self.add_rows_of(camera, move, inside, position))
        self.sync += If(move,
            position.needed.eq(Mux(needs[0] > needs[1], needs[0], needs[1]))
        )

    def add_rows_of(self, camera, move, inside, position):
        """Return the count of complete rows that a camera's position needs, 0 if none."""
        bits          = self.parameters.count_bits
        row           = getattr(inside, f"{camera}_row")[:bits]
        rows, columns = getattr(inside, f"{camera}_rows_inside"), getattr(inside, f"{camera}_columns_inside")
        used          = Signal()
        count         = Signal(bits)
        need          = Signal(bits)
        self.comb += [
            used.eq((rows != 0) & (columns != 0)),
            # The lower row, or the upper one if that is the last of the image; a row above the image is -1.
            count.eq(row + 1 + rows[1]),
            need.eq(Mux(used, count, 0)),
        ]
        self.sync += If(move,
            getattr(position, f"{camera}_used").eq(used),
            # The upper row, or the lower one if that is the first.
            getattr(position, f"{camera}_gone").eq(row + self.parameters.rows + (rows[0] == 0)),
        )
        return need

    def add_frame(self, position, counts):
        """Let a position leave when its rows are there; count rows from the beginning of its frame."""
        self.comb += [
            self.taken.eq(position.valid & self.credit & ~self.ending & (counts.written >= position.needed)),
            counts.frame.eq(self.ending & (counts.written >= self.height)),
        ]
        self.sync += [
            counts.written.eq(counts.written + counts.row),
            counts.limit.eq(counts.needed + self.lead),
            If(position.valid & ~self.ending & (position.needed > counts.needed),
                counts.needed.eq(position.needed)
            ),
            # The rest of the frame comes in.
            If(self.taken & position.last,
                self.ending.eq(1),
                counts.needed.eq(self.height)
            ),
            If(counts.frame,
                self.ending.eq(0),
                counts.needed.eq(0),
                counts.limit.eq(self.lead),
                counts.written.eq(counts.written - self.height + counts.row)
            ),
        ]

    def add_tracks(self, position, counts):
        """Find the track of a position's upper row from its distance to the row under way."""
        source = self.source
        rows   = self.parameters.rows
        gone   = Signal(len(CAMERAS))
        track  = delayed(self, counts.track, 1)
        for number, camera in enumerate(CAMERAS):
            counted  = Signal()
            distance = Signal(max=rows + 1)
            back     = Signal(max=rows + 1)
            inner    = Signal(bits_for(rows) + 2) # Two's complement.
            self.comb += [
                gone[number].eq(getattr(position, f"{camera}_used")
                    & (counts.written >= getattr(position, f"{camera}_gone"))),
                counted.eq(getattr(position, f"{camera}_used") & ~gone[number]),
                # 1 to rows - 1 for a row of the image, rows for the one above it.
                distance.eq(counts.written - getattr(position, f"{camera}_row")),
                inner.eq(track - back),
            ]
            self.sync += [
                back.eq(only_if(counted, distance)),
                getattr(source, f"{camera}_track").eq(inner + Mux(inner[-1], rows, 0)),
            ]
            # A row that is gone counts as outside.
            inside = Signal(2)
            self.sync += inside.eq(only_if(counted, getattr(position, f"{camera}_rows_inside")))
            self.comb += getattr(source, f"{camera}_rows_inside").eq(delayed(self, inside, 1))
            for name in ("column", "columns_inside", "column_fraction", "row_fraction"):
                self.comb += getattr(source, f"{camera}_{name}").eq(
                    delayed(self, getattr(position, f"{camera}_{name}"), 2))
        self.comb += [
            source.valid.eq(delayed(self, self.taken, 2)),
            source.row_gone.eq(delayed(self, gone != 0, 2)),
            source.folded.eq(delayed(self, position.folded, 2)),
            source.frame_first.eq(delayed(self, position.first, 2)),
            source.frame_last.eq(delayed(self, position.last, 2)),
        ]
