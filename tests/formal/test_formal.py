#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The proofs hold for the cores as they are, and refuse faulty cores for the expected reason."""

from dataclasses import replace
from functools import partial

import pytest

from formal.__main__ import TASKS, Task
from formal.crossing import crossing, crossing_reset, pulse_crossing
from formal.frame_guard import frame_guard
from formal.line_buffer import line_buffer
from formal.map_parts import map_parts
from formal.matcher import matcher
from formal.message_buffer import message_buffer
from formal.message_framer import message_framer
from formal.message_sorter import message_sorter
from formal.pair_gate import pair_gate
from formal.pair_join import pair_join
from formal.pair_reader import pair_reader
from formal.passing import arbiter, register
from formal.peripheral import peripheral
from formal.raster import raster
from formal.result_map import border, left_right
from formal.row_window import row_ring, row_window
from formal.send_queue import send_queue
from formal.slot_table import slot_table
from formal.solver import decide
from formal.stream_reader import stream_reader
from formal.stream_writer import stream_writer
from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.row_window import RowWindow
from support.faulty_core import altered

FAULTS = {
    "valid dropped": (
        border, "border", "Border", "self.busy & (~inside | self.sink.valid)",
        "self.busy & (~inside | self.sink.valid) & ~(self.source.ready & column[0])", "what is offered stays"),
    "a winner too early": (
        border, "border", "Border", "(row >= margin)", "(row + 2 >= margin)",
        "a winner for each pixel of the valid region, and for no other"),
    "a word too many": (
        stream_reader, "stream_reader", "StreamReader", "position == last_word", "position > last_word",
        "no address outside of [base, base + length)"),
    "the last item not marked": (
        stream_reader, "stream_reader", "StreamReader", "item == last_item", "item == last_item + 1",
        "the last item, and no other, is marked"),
    "a request given up": (
        stream_writer, "stream_writer", "StreamWriter",
        'If(asked | ~fifo.source.valid,\n                    NextState("DRAIN")\n                ).Else(\n'
        '                    NextState("DRAIN-REQUEST")\n                )', 'NextState("DRAIN")',
        "a request stays until it is answered"),
    "a word written elsewhere": (
        stream_writer, "stream_writer", "StreamWriter", "position.eq(position + 1)", "position.eq(position + 2)",
        "position counts requests"),
    "a word lost": (
        stream_writer, "stream_writer", "StreamWriter", "running & (~full | fifo.sink.ready)", "running",
        "a word is made of items"),
    "a word beyond the image": (
        pair_reader, "pair_reader", "PairReader", "last_pixel.eq(self.pixels - 1)", "last_pixel.eq(self.pixels)",
        "settings of the frame"),
    "a ring too long": (
        line_buffer, "line_buffer", "LineBuffer", "ring_row == last_row", "ring_row == last_row + 1",
        "the address stays within block_size rows"),
    "settings taken at any time": (
        peripheral, "stereo_peripheral", "StereoPeripheral", "self.sync += If(begin, [",
        "self.sync += If(self.start, [", "of a frame holds until the next"),
    "illegal settings": (
        peripheral, "stereo_peripheral", "StereoPeripheral", "If(legal,", "If(legal | (self.frame.width == 0),",
        "DMA begins with legal settings alone"),
    "a pair without credit": (
        raster, "raster", "Raster", "self.sink.ready.eq(running & self.credit & take)",
        "self.sink.ready.eq(running & take)", "a step, and a pair, only with credit"),
    "a mark lost": (
        register, "stream_register", "add_register", "ready.source.connect(data.sink),",
        'ready.source.connect(data.sink, omit={"last"}),', "items come out as they went in, in order"),
    "an item too many": (
        crossing, "crossing", "Crossing", "sink.ready.eq(~full & ~reset.blocked[cd_from])",
        "sink.ready.eq(~reset.blocked[cd_from])", "pointers are in order"),
    "a pointer that a reset leaves": (
        crossing_reset, "crossing", "Crossing", "produce.clear.eq(reset.clear[cd_from])", "produce.clear.eq(0)",
        "what it offers has come in since a reset"),
    "a word while a reset is under way": (
        crossing_reset, "crossing", "Crossing", "sink.ready.eq(~full & ~reset.blocked[cd_from])",
        "sink.ready.eq(~full)", "it accepts nothing while a reset is under way"),
    "a pulse that comes twice": (
        pulse_crossing, "pulse_crossing", "PulseCrossing", "gone.ce.eq(self.o)",
        "gone.ce.eq(self.o & (counted[0] != gone.q[0]))", "what is under way is between them"),
    "a pulse lost": (
        pulse_crossing, "pulse_crossing", "PulseCrossing", "self.o.eq((gone.q != counted)",
        "self.o.eq((gone.q[0] != counted[0])", "after two clocks of its side at most"),
    "a message held too long": (
        arbiter, "message_arbiter", "MessageArbiter", "If(self.source.valid & self.source.ready,",
        "If(self.payload.valid & self.payload.ready,", "after its end there is a clock without"),
    "a word too few": (
        message_framer, "message_framer", "MessageFramer", "rounded.eq(sink.length + 3)", "rounded.eq(sink.length)",
        "its last word but one"),
    "words written over": (
        message_buffer, "message_buffer", "MessageBuffer", "room.eq((level != words) &", "room.eq(",
        "no word that waits is written over"),
    "a mark a word early": (
        message_buffer, "message_buffer", "MessageBuffer", "self.source.last.eq(index == last_word)",
        "self.source.last.eq(index + 1 == last_word)", "a message has its words, the last one marked"),
    "a chunk too long": (
        slot_table, "slot_table", "SlotTable", "(self.chunk.length == expected)", "(self.chunk.length >= expected)",
        "and lies inside one of its images"),
    "a mark in another slot": (
        slot_table, "slot_table", "SlotTable", "If(self.chunk.judge & ~finished", "If(~finished",
        "and nothing else"),
    "a mark that gives way to clearing": (
        slot_table, "slot_table", "SlotTable", "If(self.set | ~self.clearing,\n                update",
        "If(~self.clearing,\n                update", "a set marks the bit of its chunk"),
    "a chunk that does not fit": (
        message_sorter, "message_sorter", "MessageSorter", "Elif(~table.chunk.fits,", "Elif(0,",
        "a chunk is written when it fits and has not come before"),
    "a pair too many": (
        pair_gate, "pair_gate", "PairGate", "self.sink.last & (lane | self.odd)", "self.sink.last & lane",
        "so is the last"),
    "a verdict of the frame before": (
        pair_gate, "pair_gate", "PairGate", "self.begin & (changed == 0)", "self.begin", "no pair beyond the frame"),
    "memory beside the job": (
        send_queue, "send_queue", "SendQueue", "reader.base.eq(message.base)", "reader.base.eq(message.base + 4)",
        "no address outside of [base, base + length) of a job"),
    "a field left out": (
        send_queue, "send_queue", "SendQueue", "offered.source.connect(self.source)",
        'offered.source.connect(self.source, omit={"offset"})',
        "its messages are its parts, one after the other, with all fields"),
    "a reply that comes again": (
        send_queue, "send_queue", "SendQueue", "answered.eq(self.done & ~self.chosen)",
        "answered.eq(self.done & ~self.chosen & ~self.burst_busy)", "the reply is all of it"),
    "a burst that goes on": (
        send_queue, "send_queue", "SendQueue", "If(self.chosen & self.aborted,", "If(0,",
        "a burst that was given up reads no further message"),
    "a place for a part that is omitted": (
        map_parts, "map_parts", "MapParts", "If(~omit,\n                        place.eq",
        "If(1,\n                        place.eq", "there is its place"),
    "a message torn away": (
        map_parts, "map_parts", "MapParts", "Mux(self.taken, self.source.ready, dropping)",
        "dropping | (self.taken & self.source.ready)", "the FIFO holds the parts"),
    "an odd pixel lost": (
        map_parts, "map_parts", "MapParts", "(pixel[0] | sink.last)", "pixel[0]", "memory holds the word of part 0"),
    "a word shown twice": (
        map_parts, "map_parts", "MapParts", "read.adr.eq(Cat(following, first))", "read.adr.eq(Cat(index, first))",
        "what memory shows is in it"),
    "a header of another map": (
        map_parts, "map_parts", "MapParts", "If(self.open,\n                [getattr(header",
        "If(self.sink.valid,\n                [getattr(header", "is the map's"),
    "a frame that ends with a row": (
        frame_guard, "frame_guard", "FrameGuard", 'If(self.moves & self.last,\n                NextState("END")',
        'If(self.moves & self.row_full,\n                NextState("END")', "no pixel too few"),
    "a frame that goes on": (
        frame_guard, "frame_guard", "FrameGuard", 'If(self.moves & self.last,\n                NextState("END")',
        'If(self.moves & self.last & self.sink.valid,\n                NextState("END")', "no pixel too many"),
    "a mark in each row": (
        frame_guard, "frame_guard", "FrameGuard", "self.row_full & (self.row == self.rows)", "self.row_full",
        "so is the last"),
    "a row that is not cut": (
        frame_guard, "frame_guard", "FrameGuard",
        "source.valid.eq(~self.given),\n                sink.ready.eq(self.given | ",
        "source.valid.eq(1),\n                sink.ready.eq(", "rows of the sensor are followed"),
    "a flag that does not hold": (
        frame_guard, "frame_guard", "FrameGuard", "self.flags.eq(self.flags | Cat(*self.events.values()))",
        "self.flags.eq(Cat(*self.events.values()))", "the flags are the events of the frame"),
    "a frame begun in another one": (
        frame_guard, "frame_guard", "FrameGuard", 'self.dropped.eq(self.item["frame_begin"])', "self.dropped.eq(0)",
        "a frame of the sensor's that does not begin is dropped"),
    "a pixel taken back": (
        frame_guard, "frame_guard", "FrameGuard", 'fsm.act("PAD",\n            source.valid.eq(1),',
        'fsm.act("PAD",\n            source.valid.eq(self.accept),', "what is offered stays"),
    "a pair of one frame": (
        pair_join, "pair_join", "PairJoin", "left.held & right.held", "left.held",
        "right: the frame of a pair has begun since the newest start"),
    "a pair of an older start": (
        pair_join, "pair_join", "PairJoin", "hindered.eq(starts | left.absent", "hindered.eq(left.absent",
        "before another one is found"),
    "a size taken over in mid frame": (
        pair_join, "pair_join", "PairJoin", "quiet.eq(left.empty & right.empty &", "quiet.eq(left.empty &",
        "right: the size of a frame holds while it is inside"),
    "a pair that ends before a guard": (
        pair_join, "pair_join", "PairJoin", "If(left.complete & right.complete,", "If(left.complete,",
        "a pair has ended when both guards have ended their frames"),
    "a second pair of one opening": (
        pair_join, "pair_join", "PairJoin", "self.open & armed & self.sized", "self.open & self.sized",
        "a pair begins when what follows takes one"),
    "a pixel without its partner": (
        pair_join, "pair_join", "PairJoin", "left.ready.eq(right.valid & source.ready)", "left.ready.eq(source.ready)",
        "so is the last"),
    "damages of the other side": (
        pair_join, "pair_join", "PairJoin", "Cat(*self.damages)", "Cat(*self.damages[::-1])",
        "then it has the damages of both"),
    "a row read too early": (
        row_window, "row_window", "RowWindow", "(counts.written >= position.needed)",
        "(counts.written + 1 >= position.needed)", "it waits for its rows"),
    "a track beyond the ring": (
        row_ring, "row_ring", "RowRing", "Mux(next_track == parameters.rows//2, 0, next_track)", "next_track",
        "is in the bank"),
}

#: Promises of the rows that the rectifier keeps: what is made, what is altered, and the promise that breaks.
ROW_FAULTS = {
    "a row overwritten as it is read": (
        row_window, "row_window", "RowWindow",
        '(counts.written >= getattr(position, f"{camera}_gone"))',
        '(counts.written > getattr(position, f"{camera}_gone"))',
        "no read meets a row that is written"),
    "a word overwritten as it is read": (
        row_ring, "row_ring", "RowRing", "columns[0].eq(sink.column[1:] + sink.column[0])",
        "columns[0].eq(sink.column[1:])", "is what was written last"),
    "a row of the next frame not counted": (
        row_window, "row_window", "RowWindow", "counts.written.eq(counts.written - self.height + counts.row)",
        "counts.written.eq(counts.written - self.height)", "complete rows are counted"),
    "a track too many": (
        row_window, "row_window", "RowWindow", "If(counts.track == self.parameters.rows - 1,",
        "If(counts.track == self.parameters.rows,", "rows fill the tracks in order"),
    "needed rows that are forgotten": (
        row_window, "row_window", "RowWindow", "(position.needed > counts.needed)",
        "(position.needed != counts.needed)", "needed rows are counted"),
    "a row gone in one camera": (
        row_window, "row_window", "RowWindow", "source.row_gone.eq(delayed(self, gone != 0, 2))",
        "source.row_gone.eq(delayed(self, gone == 3, 2))", "a row that is gone is told"),
    "a row given up too early": (
        partial(row_window, missing=0), "row_window", "RowWindow",
        '(counts.written >= getattr(position, f"{camera}_gone"))',
        '(counts.written + 1 >= getattr(position, f"{camera}_gone"))',
        "with enough rows none is gone"),
    "rows that come in too early": (
        partial(row_window, missing=0), "row_window", "RowWindow", "counts.limit.eq(counts.needed + self.lead)",
        "counts.limit.eq(counts.needed + self.lead + 1)", "with enough rows none is gone"),
}

#: Clocks until a fault shows, if not 16. A bounded proof has to find its faults in the clocks that it checks.
CLOCKS = {border: 32} | {task.make: task.clocks for task in TASKS if not task.induction}


#: Clocks within which a ring of six rows of two columns is full, and a row of it gone.
ROW_CLOCKS = 24


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str) -> None:
    """The proof of a faulty core fails at the promise that the fault breaks."""
    make, module, core, old, new, broken = FAULTS[fault]
    verdict = decide(make(getattr(altered(module, old, new), core)), CLOCKS.get(make, 16))
    assert any(broken in name for name in verdict.failed), verdict.failed


@pytest.mark.long
@pytest.mark.parametrize("fault", ROW_FAULTS)
def test_a_fault_of_rows_is_found(fault: str) -> None:
    """Each promise refuses a fault by itself: other ones, which it needs for the induction, may fail before it."""
    make, module, core, old, new, broken = ROW_FAULTS[fault]
    verdict = decide(make(getattr(altered(module, old, new), core)).only(broken), ROW_CLOCKS)
    assert verdict.failed and all(broken in name for name in verdict.failed)


@pytest.mark.long
def test_two_rows_too_few_are_found() -> None:
    """Of maps that need all rows of the ring one that has two rows fewer loses some, and tells so."""
    def smaller(parameters: RectifierParameters) -> RowWindow:
        return RowWindow(replace(parameters, rows=parameters.rows - 2))

    broken = "with enough rows none is gone"
    assert decide(row_window(smaller, missing=0).only(broken), ROW_CLOCKS).failed == [broken]


def test_a_promise_that_is_not_there() -> None:
    """A proof has the promise that it is reduced to."""
    with pytest.raises(LookupError, match="no promise 'as it is not'"):
        row_ring().only("as it is not")


def test_a_bounded_proof_that_ends_too_early_is_refused() -> None:
    """Promises are checked for as many clocks as what must be possible needs, or hold always."""
    Task("enough", pair_gate, 11, cover=11)
    Task("by induction", pair_gate, 11, 1, 16)
    with pytest.raises(ValueError, match="too few: promises are checked for 11 clocks, but .* is sought for 12"):
        Task("too few", pair_gate, 11, cover=12)


CREDITS = {
    "left-right check": (
        left_right, "left_right", "LeftRight", "FIFO_DEPTH - second_pass.latency - 2",
        "FIFO_DEPTH - second_pass.latency + 2", 12),
    "winners": (matcher, "matcher", "Matcher", "used < fifo.depth - UNCOUNTED_STEPS", "used < fifo.depth - 2", 6),
}


@pytest.mark.long
@pytest.mark.parametrize("credit", CREDITS)
def test_a_credit_too_many_is_found(credit: str) -> None:
    """The induction finds a FIFO that overflows only after many clocks."""
    make, module, core, old, new, induction = CREDITS[credit]
    assert not decide(make(getattr(altered(module, old, new), core)), 4, induction).always


#: Proofs that take minutes.
SLOW = {"Crossing, resets", "MessageBuffer", "MessageSorter", "PairGate", "PairJoin", "RowWindow, enough rows",
        "RowWindow, two too few", "SlotTable"}


@pytest.mark.parametrize("task", [pytest.param(task, id=task.name, marks=[pytest.mark.long]*(task.name in SLOW))
                                  for task in TASKS])
def test_a_core_as_it_is_passes(task: Task) -> None:
    """The proofs hold for the cores as they are."""
    verdict = decide(task.make(), task.clocks, task.induction, task.cover)
    assert verdict.holds, (verdict.failed, verdict.missed)
    assert verdict.always >= bool(task.induction)
