#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common import *
from .message import *

# Slot Table ---------------------------------------------------------------------------------------

class SlotTable(LiteXModule):
    """Frame slots that may be written from the wire, and which of their chunks have arrived.

    A slot is opened for a frame: its id, where it lies, how many pixels an image has. The left image begins at its
    base, the right one `pitch` bytes behind, an image rounded up to whole chunks.

    A chunk is judged from its `frame_id`, `offset` and `length`, which stand still while `judge` is 1. The verdict is there with
    `judged` and stays until the next one; `set` then marks the chunk as arrived.

    Parameters
    ----------
    slots : int
        Slots.
    max_chunks : int
        Most chunks of a frame, both images; a power of 2, at least 32.
    """
    def __init__(self, slots=4, max_chunks=1024):
        check(1 <= slots <= 16, f"slots must be 1 to 16, not {slots}.")
        check(max_chunks >= 32 and max_chunks & (max_chunks - 1) == 0,
            f"max_chunks must be a power of 2, at least 32, not {max_chunks}.")
        words      = max_chunks//32 # Of the bitmap, per slot.
        index_bits = bits_for(max_chunks)

        # Slots.
        self.slot     = Signal(4)  # Slot to open or close.
        self.frame_id = Signal(32) # Of the frame to open.
        self.base     = Signal(32) # Byte address of its left image.
        self.pixels   = Signal(32) # Of one image; of more than max_chunks//2 chunks none is taken.
        self.open     = Signal()   # Open the slot (pulse). Not while clearing.
        self.close    = Signal()   # Close the slot (pulse).
        self.clearing = Signal()   # The slot is being prepared; it opens when that is done.
        # Chunk to judge.
        self.chunk_frame_id = Signal(32)
        self.chunk_offset   = Signal(32)
        self.chunk_length   = Signal(32)
        self.judge          = Signal()
        # Verdict.
        self.judged   = Signal()
        self.fits     = Signal()   # A chunk of an open frame.
        self.repeated = Signal()   # It has arrived before.
        self.found    = Signal(4)  # Slot of the frame.
        self.address  = Signal(32) # Where the chunk belongs.
        self.set      = Signal()   # Mark it as arrived (pulse).
        # Which have arrived.
        self.index   = Signal(16)  # Word of the bitmaps: slot x words + word.
        self.arrived = Signal(32)  # That word, a clock later.
        self.missing = Signal(16)  # Chunks missing of that slot.

        # # #

        # Slots.
        # ------
        opened    = [Signal(name=f"opened{n}") for n in range(slots)]
        frame_ids = [Signal(32, name=f"frame_id{n}") for n in range(slots)]
        bases     = [Signal(32, name=f"base{n}") for n in range(slots)]
        pixels    = [Signal(32, name=f"pixels{n}") for n in range(slots)]
        chunks    = [Signal(index_bits, name=f"chunks{n}") for n in range(slots)] # Of one image.
        missings  = [Signal(index_bits, name=f"missing{n}") for n in range(slots)]
        pending   = Signal(4) # Slot that is being cleared,
        wanted    = Signal()  # and that has not been closed meanwhile.
        rounded   = Signal(33)
        needed    = Signal(index_bits)
        self.comb += [
            rounded.eq(self.pixels + CHUNK_BYTES - 1),
            If(rounded[10:] <= max_chunks//2,
                needed.eq(rounded[10:])
            ),
        ]

        # Bitmaps: one side for chunks and clearing, one for software.
        # ------------------------------------------------------------
        memory = Memory(32, slots*words, name="arrived_chunks")
        update = memory.get_port(write_capable=True, mode=READ_FIRST)
        look   = memory.get_port(mode=READ_FIRST)
        self.specials += memory, update, look
        # No register more: software may read in the clock behind the one in which it has written the index.
        self.comb += [
            look.adr.eq(self.index),
            self.arrived.eq(look.dat_r),
        ]

        clear_word = Signal(max=max(words, 2))
        clear_last = Signal()
        chunk_word = Signal(max=slots*words)
        marked     = Signal(32)
        self.comb += [
            clear_last.eq(clear_word == words - 1),
            # A chunk that is being marked goes first.
            If(self.set | ~self.clearing,
                update.adr.eq(chunk_word),
                update.dat_w.eq(marked),
                update.we.eq(self.set)
            ).Else(
                update.adr.eq(pending*words + clear_word),
                update.dat_w.eq(0),
                update.we.eq(1)
            ),
        ]
        self.sync += [
            If(self.clearing & ~self.set,
                clear_word.eq(clear_word + 1),
                If(clear_last,
                    clear_word.eq(0),
                    self.clearing.eq(0)
                )
            ),
            If(self.open,
                self.clearing.eq(1),
                clear_word.eq(0),
                pending.eq(self.slot),
                wanted.eq(1)
            ),
            If(self.close & (self.slot == pending),
                wanted.eq(0)
            ),
        ]
        for n in range(slots):
            self.sync += [
                If(self.clearing & clear_last & ~self.set & (pending == n),
                    opened[n].eq(wanted)
                ),
                If((self.open | self.close) & (self.slot == n),
                    opened[n].eq(0)
                ),
                If(self.open & (self.slot == n),
                    frame_ids[n].eq(self.frame_id),
                    bases[n].eq(self.base),
                    pixels[n].eq(self.pixels),
                    chunks[n].eq(needed),
                    missings[n].eq(Cat(C(0, 1), needed))
                ).Elif(self.set & (self.found == n),
                    missings[n].eq(missings[n] - 1)
                ),
            ]
        self.sync += Case(self.index[log2_int(words):], {n: self.missing.eq(missings[n]) for n in range(slots)})

        # Verdict, a register after each step.
        # ------------------------------------
        hits      = Signal(slots)
        hit       = Signal()
        slot      = Signal(4)
        image     = Signal(32)         # Pixels of the frame's images,
        per_image = Signal(index_bits) # and their chunks.
        base      = Signal(32)
        chunk     = Signal(22)         # Chunk of the upload space,
        beyond    = Signal(22)         # counted from the right image,
        local     = Signal(22)         # or from its own.
        inside    = Signal()
        before    = Signal(32)         # Pixels of the image before the chunk,
        left      = Signal(32)         # and from the chunk to the image's end.
        expected  = Signal(11)
        word      = Signal(max=slots*words)
        self.comb += [
            chunk.eq(self.chunk_offset[10:]),
            beyond.eq(chunk - per_image),
            before.eq(Cat(C(0, 10), local)),
            word.eq(Cat(chunk[5:5 + log2_int(words)], slot)),
        ]
        self.sync += [
            [hits[n].eq(opened[n] & (frame_ids[n] == self.chunk_frame_id)) for n in range(slots)],
            # Which slot; ids are unique.
            hit.eq(hits != 0),
            slot.eq(0),
            image.eq(0),
            per_image.eq(0),
            base.eq(0),
            [If(hits[n], slot.eq(n), image.eq(pixels[n]), per_image.eq(chunks[n]), base.eq(bases[n])) for n in range(slots)],
            # Which image, and how far from its end.
            local.eq(Mux(chunk < per_image, chunk, beyond)),
            inside.eq(chunk < Cat(C(0, 1), per_image)),
            left.eq(image - before),
            expected.eq(Mux(left < CHUNK_BYTES, left, CHUNK_BYTES)),
        ]

        # It is taken over when all steps are through, and nothing was cleared meanwhile.
        # -------------------------------------------------------------------------------
        steps   = 7
        step    = Signal(max=steps + 1)
        through = Signal()
        self.comb += [
            self.judged.eq(step == steps),
            through.eq(step == steps - 1),
        ]
        self.sync += [
            If(~self.judge | self.clearing,
                step.eq(0)
            ).Elif(~self.judged,
                step.eq(step + 1)
            ),
            If(~through & ~self.judged,
                chunk_word.eq(word)
            ),
            If(through,
                self.fits.eq(hit & inside & (self.chunk_offset[:10] == 0) & (self.chunk_length == expected)),
                self.found.eq(slot),
                self.address.eq(base + self.chunk_offset),
                self.repeated.eq((update.dat_r >> chunk[:5]) & 1),
                marked.eq(update.dat_r | (1 << chunk[:5]))
            ),
        ]
