#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

# Chunk Check --------------------------------------------------------------------------------------

class ChunkCheck(Record):
    r"""The question whether a chunk is wanted, and the answer: `MessageSorter` asks, `SlotTable` and `PairGate` answer.

    `judge` and the header's fields hold until `judged`: two clocks later from `PairGate`, seven from `SlotTable`, which
    begins again while it clears a slot. `judged`, `fits` and `repeated` count while `judge` is 1.

                                      ________________________
        judge                     ___/                        \______
                                      ________________________
        frame_id, offset, length  ---<________________________>------
                                                          ____
        judged                    _______________________/    \______
                                                          ____
        fits, repeated            -----------------------<____>------

    A chunk that comes again still fits a `SlotTable`, but not a `PairGate`, which waits for the next one. A chunk that
    is taken is acknowledged: by `PairGate.begin` in the clock of `judged`, before its words, or by `SlotTable.set`
    after them.
    """
    def __init__(self):
        Record.__init__(self, [
            # Question.
            ("frame_id", 32), # Frame of the chunk,
            ("offset",   32), # where it begins in the frame, in bytes,
            ("length",   32), # and how many bytes it has.
            ("judge",     1), # The question is asked.
            # Answer.
            ("judged",    1), # It is answered.
            ("fits",      1), # The chunk is one that the core takes.
            ("repeated",  1), # The chunk has come before.
        ], name="chunk")

    def ask(self, header):
        """Return statements that fill in the chunk from the words of its header."""
        return [
            self.frame_id.eq(header[3]),
            self.offset.eq(header[4]),
            self.length.eq(header[5]),
        ]
