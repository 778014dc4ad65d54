#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .layouts import *

# Damages of a frame, as bits of its flags; `FrameGuard` has an event of the same name for each.
DAMAGES = ("short_row", "long_row", "missing_row", "extra_row", "stuck", "overrun")

# Frame Guard --------------------------------------------------------------------------------------

@ResetInserter()
class FrameGuard(LiteXModule):
    """Frames of exactly width x height pixels, for any behaviour of the sensor.

    A frame begins with the sensor's, if `accept` is 1 then; otherwise it is dropped. The missing pixels of a short row
    are 0, and those of missing rows; pixels beyond the width are cut off, and rows beyond the height. Each of these is
    an event and a flag:

    - ``short_row``, ``long_row``: a row that has begun has fewer or more than `width` pixels.
    - ``missing_row``, ``extra_row``: a row of the frame has not come at all, or one after its last row has.
    - ``stuck``: no mark has come for `silence` clocks: the clock, HREF or VSYNC stays as it is. The frame is given up:
      what is missing is filled, and what comes until the sensor's next frame is ignored.
    - ``overrun``: items of the frame were lost in front of `sink`, one event for each gap.

    While the rest of a frame is filled, items are taken and ignored, so that none are lost: a frame that begins
    meanwhile is dropped. Clocks in which `source` waits are not counted as silence, so a slow successor cannot make a
    frame stuck. A row of 0 pixels is a short row. `silence` holds while a frame is under way.
    """
    def __init__(self, parameters):
        self.sink    = stream.Endpoint(captured_layout())    # Items of the sensor.
        self.source  = stream.Endpoint(pixel_layout())       # Frames, raster order; first and last.
        self.width   = Signal(max=parameters.max_width + 1)  # Columns of a frame, from 1 up; taken at its begin.
        self.height  = Signal(max=parameters.max_height + 1) # Rows of a frame, from 1 up; taken at its begin.
        self.silence = Signal(parameters.silence_bits)       # Longest time within a frame without a mark, in clocks.
        self.accept  = Signal()                              # A frame may begin.
        self.begun   = Signal()                              # A frame begins (pulse).
        self.dropped = Signal()                              # One begins that is not accepted (pulse).
        self.ended   = Signal()                              # A frame, and the sensor's, has ended (pulse).
        self.flags   = Signal(len(DAMAGES))                  # `DAMAGES` of the frame, from `ended` to the next `begun`.
        self.busy    = Signal()                              # A frame is under way.
        self.events  = {name: Signal(name=name) for name in DAMAGES} # Damages as they happen (pulses).
        self.latency = None                                  # Rows are filled.

        # # #

        self.add_place()
        self.add_silence()
        self.add_items()
        self.add_fsm()
        self.add_flags()

    def add_place(self):
        """Count the pixels of the frame: the place of the next one."""
        self.columns  = Signal.like(self.width)  # Size of the frame.
        self.rows     = Signal.like(self.height)
        self.column   = Signal.like(self.width)  # Place of the next pixel.
        self.row      = Signal.like(self.height)
        self.moves    = Signal()                 # A pixel leaves (pulse),
        self.row_full = Signal()                 # the last one of its row,
        self.last     = Signal()                 # or of the frame is next.
        self.comb += [
            self.moves.eq(self.source.valid & self.source.ready),
            self.row_full.eq(self.column == self.columns),
            self.last.eq(self.row_full & (self.row == self.rows)),
            self.source.first.eq((self.column == 0) & (self.row == 0)),
            self.source.last.eq(self.last),
        ]
        self.sync += [
            If(self.moves,
                self.column.eq(self.column + 1),
                If(self.row_full,
                    self.column.eq(0),
                    self.row.eq(self.row + 1)
                )
            ),
            If(self.begun,
                self.columns.eq(self.width - 1),
                self.rows.eq(self.height - 1),
                self.column.eq(0),
                self.row.eq(0)
            ),
        ]

    def add_silence(self):
        """Count clocks since the last mark of the sensor."""
        self.mark   = Signal() # A mark is taken (pulse).
        self.silent = Signal() # For too long.
        clocks = Signal.like(self.silence)
        self.comb += [
            self.mark.eq(self.sink.valid & self.sink.ready & (self.sink.kind != PIXEL)),
            self.silent.eq(clocks == self.silence),
        ]
        self.sync += If(self.mark | ~self.busy,
            clocks.eq(0)
        ).Elif(~self.silent & (~self.source.valid | self.source.ready),
            clocks.eq(clocks + 1)
        )

    # States -----------------------------------------------------------------------------------------

    def add_items(self):
        """Tell the kinds of items apart, and keep what is known of the row under way."""
        sink  = self.sink
        kinds = {"pixel": PIXEL, "row_end": ROW_END, "frame_begin": FRAME_BEGIN, "frame_end": FRAME_END}
        self.item  = {name: Signal(name=f"item_{name}") for name in kinds}
        self.given = Signal() # The row has all its pixels, or it is an extra row that has some.
        self.cut   = Signal() # It has had too many.
        self.comb += [self.item[name].eq(sink.valid & (sink.kind == kind)) for name, kind in kinds.items()]

    def add_fsm(self):
        """Wait for a frame of the sensor's, and end it a clock after its last event: then the flags are there."""
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += self.busy.eq(~fsm.ongoing("IDLE"))
        fsm.act("IDLE",
            self.sink.ready.eq(1),
            NextValue(self.given, 0),
            NextValue(self.cut, 0),
            If(self.item["frame_begin"],
                self.begun.eq(self.accept),
                self.dropped.eq(~self.accept),
                If(self.accept,
                    NextState("ROWS")
                )
            )
        )
        self.add_rows(fsm)
        self.add_filling(fsm)
        self.add_rest(fsm)
        fsm.act("END",
            self.ended.eq(1),
            NextState("IDLE")
        )

    def add_rows(self, fsm):
        """Pass the rows of the sensor on. Marks that end the frame stay at `sink`: the next states take them."""
        sink, source, item, events = self.sink, self.source, self.item, self.events
        row_given = [
            NextValue(self.given, 1),
            If(self.last,
                NextState("LAST")
            ),
        ]
        fsm.act("ROWS",
            source.pixel.eq(sink.pixel),
            If(self.silent,
                events["stuck"].eq(1),
                events["short_row"].eq(self.column != 0),
                NextState("FILL")
            ).Elif(item["pixel"],
                source.valid.eq(~self.given),
                sink.ready.eq(self.given | source.ready),
                events["long_row"].eq(self.given & ~self.cut),
                NextValue(self.cut, self.given),
                If(self.moves & self.row_full,
                    *row_given
                )
            ).Elif(item["row_end"],
                sink.ready.eq(self.given),
                NextValue(self.given, 0),
                NextValue(self.cut, 0),
                If(~self.given,
                    events["short_row"].eq(1),
                    NextState("PAD")
                )
            ).Elif(item["frame_begin"] | item["frame_end"],
                events["short_row"].eq(self.column != 0),
                NextState("FILL")
            )
        )
        # The rest of a short row. Its mark waits at `sink`.
        fsm.act("PAD",
            source.valid.eq(1),
            If(self.moves & self.row_full,
                NextState("ROWS"),
                *row_given
            )
        )

    def add_filling(self, fsm):
        """Fill the rest of the frame, and ignore what the sensor sends meanwhile."""
        fsm.act("FILL",
            self.source.valid.eq(1),
            self.sink.ready.eq(1),
            self.dropped.eq(self.item["frame_begin"]),
            self.events["missing_row"].eq(self.moves & (self.column == 0)),
            If(self.moves & self.last,
                NextState("END")
            )
        )

    def add_rest(self, fsm):
        """Follow the sensor's frame when all pixels have left: what comes of its last row, and rows after that."""
        item, events = self.item, self.events
        in_last_row = [
            events["long_row"].eq(item["pixel"] & ~self.cut),
            If(item["pixel"],
                NextValue(self.cut, 1)
            ),
            If(item["row_end"],
                NextValue(self.given, 0),
                NextState("EXTRA")
            ),
        ]
        after_it = [
            events["extra_row"].eq((item["pixel"] | item["row_end"]) & ~self.given),
            If(item["pixel"],
                NextValue(self.given, 1)
            ),
            If(item["row_end"],
                NextValue(self.given, 0)
            ),
        ]
        for state, statements in (("LAST", in_last_row), ("EXTRA", after_it)):
            fsm.act(state,
                If(self.silent,
                    events["stuck"].eq(1),
                    NextState("END")
                ).Elif(item["frame_begin"],
                    # The next frame's: IDLE takes it.
                    NextState("END")
                ).Else(
                    self.sink.ready.eq(1),
                    *statements,
                    If(item["frame_end"],
                        NextState("END")
                    )
                )
            )

    # Flags ------------------------------------------------------------------------------------------

    def add_flags(self):
        """Keep the damages of a frame; find out whether items were lost."""
        self.comb += self.events["overrun"].eq(self.sink.valid & self.sink.ready & self.sink.lost)
        self.sync += If(self.begun,
            # What was lost came before this frame.
            self.flags.eq(0)
        ).Elif(self.busy,
            self.flags.eq(self.flags | Cat(*self.events.values()))
        )
