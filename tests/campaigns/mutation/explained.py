#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Mutants that may survive, and why: file, line, source, replacement. Most of them behave as the file does."""

EXPLAINED: dict[tuple[str, str, str, str], str] = {
    ("firmware/drivers/screen.c",
     "return screen->width != 0 ? screen->pictures + screen->hidden * PICTURE_BYTES : NULL;", "0", "1"):
        "The width is 0 or that of the screen. With 0 the pictures are NULL, and so is the picture number 0 of them.",
    ("firmware/link/udp/udp_stream.c", "link->streamed = -1;", "1", "2"):
        "It is compared with numbers of slots alone, none of which is negative.",
    ("firmware/reference/median.c", "for (; place > 0 && sorted[place - 1] > values[i]; place--) {", ">", ">="):
        "Equal values change their order.",
    ("gateware/post/left_right/left_right.py",
     "self.sync += second_pass.credit.eq(fifo.level < FIFO_DEPTH - second_pass.latency - 2)", "2", "3"):
        "The queue stops being filled one pixel earlier: as before it never overflows, and no pixel is another.",
    ("gateware/post/left_right/left_right.py", "write.we.eq(self.votes & self.sink.valid),",
     "self.votes & self.sink.valid", "self.votes | self.sink.valid"):
        "A winner that waits for its row is written once more, after the last column of the row before and in its "
        "first one. The second pass reads the one never, and the other for a pixel outside of the map.",
}
