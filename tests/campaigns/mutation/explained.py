#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Mutants that behave like the core, and why: core, line, source, replacement."""

EQUIVALENT: dict[tuple[str, str, str, str], str] = {
    ("left_right", "self.sync += second_pass.credit.eq(fifo.level < FIFO_DEPTH - second_pass.latency - 2)", "2", "3"):
        "The queue stops being filled one pixel earlier: as before it never overflows, and no pixel is another.",
    ("left_right", "write.we.eq(self.votes & self.sink.valid),", "self.votes & self.sink.valid",
     "self.votes | self.sink.valid"):
        "A winner that waits for its row is written once more, after the last column of the row before and in its "
        "first one. The second pass reads the one never, and the other for a pixel outside of the map.",
}
