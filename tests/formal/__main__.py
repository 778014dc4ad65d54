#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make formal`: run all proofs and print a table; the exit status is 1 if one fails."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

from .crossing import crossing, crossing_reset, pulse_crossing
from .frame_guard import frame_guard
from .line_buffer import line_buffer
from .map_parts import map_parts
from .matcher import matcher
from .message_buffer import message_buffer
from .message_framer import message_framer
from .message_sorter import message_sorter
from .pair_gate import pair_gate
from .pair_join import pair_join
from .pair_reader import pair_reader
from .passing import arbiter, register
from .peripheral import peripheral
from .proof import Proof
from .raster import raster
from .result_map import border, left_right, median
from .row_window import row_ring, row_window
from .send_queue import send_queue
from .slot_table import slot_table
from .solver import SolverError, decide
from .stream_reader import stream_reader
from .stream_writer import stream_writer


@dataclass(frozen=True)
class Task:
    """A proof and its limits in clocks: see `decide`.

    Raises
    ------
    ValueError
        Without induction the promises would be checked for fewer clocks than it takes to reach what must be possible:
        a promise on the end of something would hold as nothing has ended yet.
    """
    name:      str
    make:      Callable[[], Proof]
    clocks:    int
    induction: int = 0
    cover:     int | None = None

    def __post_init__(self) -> None:
        if not self.induction and self.clocks < (self.cover or 0):
            raise ValueError(f"{self.name}: promises are checked for {self.clocks} clocks, but what must be possible "
                             f"is sought for {self.cover}")


TASKS = [
    Task("StreamReader", lambda: stream_reader(contents=True), 8, 1, 30),
    Task("StreamReader, bus errors", stream_reader, 8, 1, 30),
    Task("StreamWriter", stream_writer, 8, 1, 30),
    Task("PairReader", pair_reader, 10, 1, 30),
    Task("LineBuffer, addresses", line_buffer, 8, 2, 22),
    Task("LineBuffer, contents", lambda: line_buffer(most_columns=2, contents=True), 14),
    Task("Border", border, 8, 4, 40),
    Task("LeftRight", left_right, 12, 12, 50),
    Task("Median", median, 8, 8, 30),
    Task("StereoPeripheral", peripheral, 6, 2, 30),
    Task("Raster", raster, 6, 2, 18),
    Task("Matcher, winners' FIFO", matcher, 8, 6, 36),
    Task("add_register", register, 8, 1, 12),
    Task("Crossing", crossing, 12, 1, 24),
    Task("Crossing, resets", crossing_reset, 28),
    Task("PulseCrossing", pulse_crossing, 12, 1, 24),
    Task("MessageArbiter", arbiter, 8, 1, 12),
    Task("MessageFramer", message_framer, 10, 1, 26),
    Task("MessageBuffer", message_buffer, 22),
    Task("SlotTable", slot_table, 14),
    Task("MessageSorter", message_sorter, 18),
    Task("PairGate", pair_gate, 16),
    Task("SendQueue", send_queue, 6, 1, 24),
    Task("MapParts", map_parts, 8, 2, 20),
    Task("FrameGuard", frame_guard, 6, 1, 20),
    Task("PairJoin", pair_join, 12, cover=10),
    Task("RowWindow", row_window, 8, 4, 24),
    Task("RowWindow, enough rows", lambda: row_window(missing=0), 8, 4, 24),
    Task("RowWindow, two too few", lambda: row_window(missing=2), 8, 4, 24),
    Task("RowRing", row_ring, 8),
]


def main() -> int:
    """Run the proofs, print a line for each, and return the exit status."""
    promises = failures = always = 0
    for task in TASKS:
        proof = task.make()
        try:
            verdict = decide(proof, task.clocks, task.induction, task.cover)
        except SolverError as error:
            print(f"formal: {error}", file=sys.stderr)
            return 1
        count     = len(proof.wanted["assert"])
        promises += count
        always   += count*verdict.always
        proven    = verdict.holds and verdict.always >= bool(task.induction)
        span      = "always" if verdict.always else f"{verdict.clocks} clocks"
        print(f"{task.name:26} {count:3} promises  {span if proven else 'FAILED':10} {verdict.seconds:6.1f} s",
              flush=True)
        if not proven:
            failures += 1
            for name in verdict.failed:
                print(f"    broken: {name}")
            for name in verdict.missed:
                print(f"    never happens: {name}")
            if verdict.holds:
                print("    holds as far as was checked, but the induction does not close")
    if failures:
        print(f"{failures} of {len(TASKS)} proofs failed.")
        return 1
    print(f"{promises} promises hold, {always} of them always and {promises - always} for the clocks that were "
          "checked.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
