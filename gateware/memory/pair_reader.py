#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .ports   import MemoryReader, buffered, word_address, word_bytes

# Pair Reader --------------------------------------------------------------------------------------

class PairReader(LiteXModule):
    """Read a left and a right image from memory and stream them as pixel pairs.

    Both images are read through one port, in alternating bursts, so that an SDRAM changes its row once per burst and
    not once per word. Images are contiguous: rows follow each other without padding, one byte per pixel; a base address
    is a multiple of the port's word.

    A frame runs from `start` (one clock, while `idle`) to its last pixel. `stop`, held until `idle`, gives it up:
    no more words are asked for, and those under way are discarded.

    It is reset with its clock domain alone, and its memory with it: an answer under way would be taken for a later one.

    Parameters
    ----------
    port : wishbone.Interface or LiteDRAMNativePort
        Port to read from.
    burst_bytes : int
        Bytes of a burst: a power of 2 times the port's word, at least 2 words.
    """
    def __init__(self, port, burst_bytes=128):
        ratio = word_bytes(port)
        burst = burst_bytes//ratio
        check(burst >= 2 and burst & (burst - 1) == 0,
            f"burst_bytes must be a power of 2 times the port's {ratio} bytes, at least 2, not {burst_bytes}.")
        self.source     = stream.Endpoint(pixel_pair_layout()) # Pixel pairs, marked first and last of the frame.
        self.left_base  = Signal(32)                           # Byte address of the left image.
        self.right_base = Signal(32)                           # Byte address of the right image.
        self.pixels     = Signal(32)                           # Pixels of an image, at least 1.
        self.start      = Signal()                             # Begin a frame (pulse).
        self.stop       = Signal()                             # Give the frame up (level).
        self.idle       = Signal()                             # No frame, nothing under way.
        self.error      = Signal()                             # Bus error (pulse).
        self.latency    = None                                 # Depends on memory.

        # # #

        self.reader     = reader = MemoryReader(port, fifo_depth=max(4, burst))
        self.right      = Signal()                # Words are asked for of 0: the left image, 1: the right image.
        self.position   = Signal(32)              # Number of the next word to ask for,
        self.last_word  = Signal(32)              # and of the image's last one.
        self.burst_end  = Signal()                # The next word is the last of the burst.
        self.asked      = Signal()                # A word is asked for.
        self.word_taken = Signal()                # A word of each image is taken out of its FIFO.
        self.under_way  = Signal(max=4*burst + 1) # Words asked for and not yet answered.
        self.remaining  = Signal(32)              # Pixel pairs that have not left.
        self.comb      += self.error.eq(reader.error)

        self.add_fifos(port, burst)
        self.add_addresses(port, ratio, burst)
        self.add_requests()
        self.add_answers()
        self.add_pixels(ratio)

    def add_fifos(self, port, burst):
        """Add a FIFO for the words of each image, with room for two bursts, and count what it holds or will hold."""
        depth      = 2*burst
        self.fifos = []
        self.rooms = [] # There is room for a burst.
        for side, is_side in [("left", ~self.right), ("right", self.right)]:
            fifo = ResetInserter()(stream.SyncFIFO([("data", port.data_width)], depth, buffered(depth)))
            self.add_module(name=f"{side}_fifo", module=fifo)
            held = Signal(max=depth + 1) # Words asked for and not yet taken out.
            room = Signal()
            self.comb += room.eq(held <= depth - burst)
            self.sync += [
                held.eq(held + (self.asked & is_side) - self.word_taken),
                If(self.idle,
                    held.eq(0)
                ),
            ]
            self.fifos.append(fifo)
            self.rooms.append(room)

    def add_addresses(self, port, ratio, burst):
        """Address the next word; a burst ends at a multiple of its size, or with the image."""
        reader     = self.reader
        last_pixel = Signal(32)
        base       = Signal(32)
        address, compute_address = word_address(port, base, self.position)
        self.comb += [
            base.eq(Mux(self.right, self.right_base, self.left_base)),
            compute_address,
            self.burst_end.eq((self.position[:log2_int(burst)] == burst - 1) | (self.position == self.last_word)),
            reader.sink.address.eq(address),
            reader.sink.last.eq(self.burst_end),
            self.asked.eq(reader.sink.valid & reader.sink.ready),
            last_pixel.eq(self.pixels - 1),
        ]
        self.sync += If(self.idle,
            self.last_word.eq(last_pixel[log2_int(ratio):])
        )

    def add_requests(self):
        """Add the states of a frame: ask for a burst of the left image, then the same one of the right image."""
        burst_base = Signal(32) # First word of this burst.
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += self.idle.eq(fsm.ongoing("IDLE"))
        fsm.act("IDLE",
            NextValue(self.right, 0),
            NextValue(self.position, 0),
            NextValue(burst_base, 0),
            If(self.start,
                NextState("WAIT")
            )
        )
        fsm.act("WAIT",
            If(self.stop,
                NextState("DRAIN")
            ).Elif(Mux(self.right, self.rooms[1], self.rooms[0]),
                NextState("BURST")
            )
        )
        fsm.act("BURST",
            self.reader.sink.valid.eq(1),
            If(self.asked,
                NextValue(self.position, self.position + 1),
                If(self.burst_end,
                    NextValue(self.right, ~self.right),
                    If(self.right,
                        NextValue(burst_base, self.position + 1),
                        If(self.position == self.last_word,
                            NextState("PIXELS")
                        ).Else(
                            NextState("WAIT")
                        )
                    ).Else(
                        NextValue(self.position, burst_base),
                        NextState("WAIT")
                    )
                )
            ),
            # A request once made stays until it is taken.
            If(self.stop,
                If(self.asked,
                    NextState("DRAIN")
                ).Else(
                    NextState("DRAIN-REQUEST")
                )
            )
        )
        fsm.act("DRAIN-REQUEST",
            self.reader.sink.valid.eq(1),
            If(self.asked,
                NextState("DRAIN")
            )
        )
        fsm.act("DRAIN",
            If(self.under_way == 0,
                NextState("IDLE")
            )
        )
        fsm.act("PIXELS",
            If(self.stop,
                NextState("DRAIN")
            ).Elif(self.remaining == 0,
                NextState("IDLE")
            )
        )

    def add_answers(self):
        """Sort the answers: they come in the order of the requests, so the image changes with each burst."""
        fifos, reader, fsm = self.fifos, self.reader, self.fsm
        draining   = Signal() # The frame was given up: answers are discarded.
        right_word = Signal() # The next answer is of the right image.
        answered   = Signal()
        self.comb += [
            draining.eq(fsm.ongoing("DRAIN") | fsm.ongoing("DRAIN-REQUEST")),
            fifos[0].reset.eq(draining),
            fifos[1].reset.eq(draining),
            fifos[0].sink.data.eq(reader.source.data),
            fifos[1].sink.data.eq(reader.source.data),
            fifos[0].sink.valid.eq(reader.source.valid & ~right_word & ~draining),
            fifos[1].sink.valid.eq(reader.source.valid &  right_word & ~draining),
            # A burst begins only if there is room for all of it: the FIFOs are always ready.
            reader.source.ready.eq(1),
            answered.eq(reader.source.valid),
        ]
        self.sync += [
            self.under_way.eq(self.under_way + self.asked - answered),
            If(answered & reader.source.last,
                right_word.eq(~right_word)
            ),
            If(self.idle,
                right_word.eq(0)
            ),
        ]

    def add_pixels(self, ratio):
        """Cut words into pixels, both images at the same time."""
        fifos       = self.fifos
        byte        = Signal(max=ratio) # Place of the next pixels in their words.
        first       = Signal()          # They are the first of the frame.
        pixel_taken = Signal()
        self.comb += [
            self.source.valid.eq(fifos[0].source.valid & fifos[1].source.valid & (self.remaining != 0)),
            self.source.left.eq( Array(lanes_of(fifos[0].source.data, ratio))[byte]),
            self.source.right.eq(Array(lanes_of(fifos[1].source.data, ratio))[byte]),
            self.source.first.eq(first),
            self.source.last.eq(self.remaining == 1),
            pixel_taken.eq(self.source.valid & self.source.ready),
            self.word_taken.eq(pixel_taken & ((byte == ratio - 1) | self.source.last)),
            fifos[0].source.ready.eq(self.word_taken),
            fifos[1].source.ready.eq(self.word_taken),
        ]
        self.sync += [
            If(pixel_taken,
                first.eq(0),
                self.remaining.eq(self.remaining - 1),
                byte.eq(byte + 1)
            ),
            If(self.idle,
                first.eq(1),
                self.remaining.eq(self.pixels),
                byte.eq(0)
            ),
        ]
