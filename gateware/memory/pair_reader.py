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

    Both images are read through one port, in alternating bursts, so that a SDRAM changes its row once a burst and not once
    a word. Images are contiguous: rows follow each other without padding, one byte per pixel; a base address is a
    multiple of the port's word.

    A frame runs from `start` (one clock, while `idle`) to its last pixel. `stop`, held until `idle`, gives it up:
    no more words are asked for and what is under way is thrown away.
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

        # # #

        self.reader = reader = MemoryReader(port, fifo_depth=max(4, burst))
        self.comb += self.error.eq(reader.error)

        # Words of each image, asked for and not yet taken out of its FIFO.
        # -----------------------------------------------------------------
        depth = 2*burst
        fifos = []
        helds = []
        rooms = []
        for side in ["left", "right"]:
            fifo = ResetInserter()(stream.SyncFIFO([("data", port.data_width)], depth, buffered(depth)))
            self.add_module(name=f"{side}_fifo", module=fifo)
            held = Signal(max=depth + 1)
            room = Signal()
            self.comb += room.eq(held <= depth - burst)
            fifos.append(fifo)
            helds.append(held)
            rooms.append(room)

        # Addresses: a burst of the left image, the same burst of the right one, and on.
        # ------------------------------------------------------------------------------
        right      = Signal()
        position   = Signal(32) # Word of the image.
        burst_base = Signal(32) # First word of this burst.
        last_pixel = Signal(32)
        last_word  = Signal(32)
        burst_end  = Signal()
        base       = Signal(32)
        asked      = Signal()
        address, compute_address = word_address(port, base, position)
        self.comb += [
            base.eq(Mux(right, self.right_base, self.left_base)),
            compute_address,
            last_pixel.eq(self.pixels - 1),
            burst_end.eq((position[:log2_int(burst)] == burst - 1) | (position == last_word)),
            reader.sink.address.eq(address),
            reader.sink.last.eq(burst_end),
            asked.eq(reader.sink.valid & reader.sink.ready),
        ]
        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            NextValue(right, 0),
            NextValue(position, 0),
            NextValue(burst_base, 0),
            NextValue(last_word, last_pixel[log2_int(ratio):]),
            If(self.start,
                NextState("WAIT")
            )
        )
        fsm.act("WAIT",
            If(self.stop,
                NextState("DRAIN")
            ).Elif(Mux(right, rooms[1], rooms[0]),
                NextState("BURST")
            )
        )
        fsm.act("BURST",
            reader.sink.valid.eq(1),
            If(asked,
                NextValue(position, position + 1),
                If(burst_end,
                    NextValue(right, ~right),
                    If(right,
                        NextValue(burst_base, position + 1),
                        If(position == last_word,
                            NextState("PIXELS")
                        ).Else(
                            NextState("WAIT")
                        )
                    ).Else(
                        NextValue(position, burst_base),
                        NextState("WAIT")
                    )
                )
            ),
            # A request once made stays until it is taken.
            If(self.stop,
                If(asked,
                    NextState("DRAIN")
                ).Else(
                    NextState("DRAIN-REQUEST")
                )
            )
        )
        fsm.act("DRAIN-REQUEST",
            reader.sink.valid.eq(1),
            If(asked,
                NextState("DRAIN")
            )
        )

        # Answers: they come in the order of the requests, so the side changes with each burst's last.
        # --------------------------------------------------------------------------------------------
        draining   = Signal()
        under_way  = Signal(max=2*depth + 1)
        right_word = Signal()
        answered   = Signal()
        self.comb += [
            draining.eq(fsm.ongoing("DRAIN") | fsm.ongoing("DRAIN-REQUEST")),
            fifos[0].sink.data.eq(reader.source.data),
            fifos[1].sink.data.eq(reader.source.data),
            fifos[0].sink.valid.eq(reader.source.valid & ~right_word & ~draining),
            fifos[1].sink.valid.eq(reader.source.valid &  right_word & ~draining),
            # A burst begins only if there is room for all of it: the FIFOs are always ready.
            reader.source.ready.eq(1),
            answered.eq(reader.source.valid),
        ]
        self.sync += [
            under_way.eq(under_way + asked - answered),
            If(answered & reader.source.last,
                right_word.eq(~right_word)
            ),
            If(fsm.ongoing("IDLE"),
                right_word.eq(0)
            ),
        ]
        fsm.act("DRAIN",
            If(under_way == 0,
                NextState("IDLE")
            )
        )

        # Words to pixels, both images in step.
        # -------------------------------------
        byte        = Signal(max=ratio)
        remaining   = Signal(32)
        first       = Signal()
        pixel_taken = Signal()
        word_taken  = Signal()
        self.comb += [
            self.source.valid.eq(fifos[0].source.valid & fifos[1].source.valid & (remaining != 0)),
            self.source.left.eq( Array(lanes_of(fifos[0].source.data, ratio))[byte]),
            self.source.right.eq(Array(lanes_of(fifos[1].source.data, ratio))[byte]),
            self.source.first.eq(first),
            self.source.last.eq(remaining == 1),
            pixel_taken.eq(self.source.valid & self.source.ready),
            word_taken.eq(pixel_taken & ((byte == ratio - 1) | self.source.last)),
            fifos[0].source.ready.eq(word_taken),
            fifos[1].source.ready.eq(word_taken),
            fifos[0].reset.eq(draining),
            fifos[1].reset.eq(draining),
            self.idle.eq(fsm.ongoing("IDLE")),
        ]
        self.sync += [
            If(pixel_taken,
                first.eq(0),
                remaining.eq(remaining - 1),
                byte.eq(byte + 1)
            ),
            If(fsm.ongoing("IDLE"),
                first.eq(1),
                remaining.eq(self.pixels),
                byte.eq(0)
            ),
        ]
        for held, is_side in zip(helds, [~right, right]):
            self.sync += [
                held.eq(held + (asked & is_side) - word_taken),
                If(fsm.ongoing("IDLE"),
                    held.eq(0)
                ),
            ]
        fsm.act("PIXELS",
            If(self.stop,
                NextState("DRAIN")
            ).Elif(remaining == 0,
                NextState("IDLE")
            )
        )
