#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from ..common     import *
from .chunk_check import ChunkCheck
from .message     import *

def frame_layout(index_bits):
    """Return the layout of a slot's frame."""
    return [
        ("frame_id", 32),
        ("base",     32),         # Byte address of the left image.
        ("pixels",   32),         # Of one image,
        ("chunks",   index_bits), # and its chunks; 0: too many, no chunk fits.
    ]

# Slot Table ---------------------------------------------------------------------------------------

class SlotTable(LiteXModule):
    """Frame slots that may be written from the wire, and which of their chunks have arrived.

    A slot is opened for a frame: its id, its place in memory, how many pixels an image has. The left image begins at
    the base, the right image `pitch` bytes after it; `pitch` is the size of an image, rounded up to whole chunks. An
    image of 2500 pixels has three chunks, at offsets 0, 1024 and 2048 of the left image, and at 3072, 4096 and 5120 of
    the right image; the last one of each has 452 bytes.

    A chunk that fits is written by `MessageSorter`, and then marked as arrived by `set`. The verdict, with `found` and
    `address`, holds until the next chunk is judged. It is reset with its clock domain alone.

    Parameters
    ----------
    slots : int
        Slots, 1 to 16.
    max_chunks : int
        Most chunks of a frame, both images; a power of 2, at least 32.
    pipelined : bool
        Add a register to `arrived`, for a system clock of more than 60 MHz on an ECP5.
    """
    def __init__(self, slots=4, max_chunks=1024, pipelined=False):
        check(1 <= slots <= 16, f"slots must be 1 to 16, not {slots}.")
        check(max_chunks >= 32 and max_chunks & (max_chunks - 1) == 0,
            f"max_chunks must be a power of 2, at least 32, not {max_chunks}.")
        # Slots.
        self.slot     = Signal(4)  # Slot to open or close.
        self.frame_id = Signal(32) # Of the frame to open.
        self.base     = Signal(32) # Byte address of its left image.
        self.pixels   = Signal(32) # Of one image. If they make more than max_chunks//2 chunks, no chunk fits.
        self.open     = Signal()   # Open the slot (pulse). Not while clearing.
        self.close    = Signal()   # Close the slot (pulse).
        self.clearing = Signal()   # The slot is being prepared; it opens when that is done.
        # Chunk to judge.
        self.chunk    = ChunkCheck() # It fits: it is a chunk of an open frame.
        self.found    = Signal(4)    # Slot of that frame.
        self.address  = Signal(32)   # Byte address of the chunk.
        self.set      = Signal()     # Mark it as arrived (pulse).
        # Which have arrived.
        self.arrived_index = Signal(16) # Word of the bitmaps to read: slot x (max_chunks // 32) + word.
        self.arrived       = Signal(32) # That word, a clock later; two if pipelined.
        self.missing       = Signal(16) # Chunks that its slot lacks, a clock later.
        self.latency       = None       # No stream.

        # # #

        self.words      = words = max_chunks//32  # Of the bitmap, per slot.
        self.index_bits = bits_for(max_chunks)
        self.opened     = [Signal(name=f"opened{n}") for n in range(slots)] # Chunks of the slot's frame fit.
        self.index      = Signal(max=max(slots, 2)) # Slot whose frame is compared with the chunk's.
        self.frame      = Record(frame_layout(self.index_bits), name="slot_frame") # That frame.
        self.pending    = Signal(4)               # Slot that is being cleared,
        self.wanted     = Signal()                # and that has not been closed meanwhile.
        self.chunk_word = Signal(max=slots*words) # Word of the bitmaps that has the chunk's bit,
        self.marked     = Signal(32)              # and that word with the bit set.

        self.add_bitmaps(pipelined)
        cleared = self.add_clearing()
        chunks  = self.add_frames(max_chunks)
        self.add_opened(cleared)
        self.add_missing(chunks)
        self.add_verdict()

    def add_bitmaps(self, pipelined):
        """Add a bit per chunk, with a port for chunks and clearing, and one for software.

        Block RAM takes half a clock of 75 MHz to show a word, so the verdict reads it from a register. Software may
        read in the second clock after it has written the index, and then gets the word without a register. LiteX's
        bridge of an SoC with SDRAM has registers, so there software reads in the third clock.
        """
        memory        = Memory(32, len(self.opened)*self.words, name="arrived_chunks")
        update        = memory.get_port(write_capable=True, mode=READ_FIRST)
        software_port = memory.get_port(mode=READ_FIRST)
        self.update   = update
        self.shown    = Signal(32) # Word that the memory has shown to the verdict.
        self.specials += memory, update, software_port
        self.sync     += self.shown.eq(update.dat_r)
        self.comb     += software_port.adr.eq(self.arrived_index)
        arrived        = self.arrived.eq(software_port.dat_r)
        if pipelined:
            self.sync += arrived
        else:
            self.comb += arrived

    def add_clearing(self):
        """Clear the bitmap of a slot before it opens, a word per clock; return the condition that it is done."""
        update     = self.update
        clear_word = Signal(max=max(self.words, 2))
        clear_last = Signal()
        self.comb += [
            clear_last.eq(clear_word == self.words - 1),
            # A chunk that is being marked goes first.
            If(self.set | ~self.clearing,
                update.adr.eq(self.chunk_word),
                update.dat_w.eq(self.marked),
                update.we.eq(self.set)
            ).Else(
                update.adr.eq(self.pending*self.words + clear_word),
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
                self.pending.eq(self.slot),
                self.wanted.eq(1)
            ),
            If(self.close & (self.slot == self.pending),
                self.wanted.eq(0)
            ),
        ]
        return self.clearing & clear_last & ~self.set

    def add_frames(self, max_chunks):
        """Keep the frame of each slot in memory; return how many chunks an image has of the frame opened last."""
        memory  = Memory(len(self.frame.raw_bits()), 2**len(self.index), name="slot_frames")
        write   = memory.get_port(write_capable=True)
        read    = memory.get_port(async_read=True)
        rounded = Signal(33)
        needed  = Signal(self.index_bits) # Chunks of an image of the frame to open; 0: too many.
        chunks  = Signal(self.index_bits)
        self.specials += memory, write, read
        self.comb += [
            rounded.eq(self.pixels + CHUNK_BYTES - 1),
            If(rounded[10:] <= max_chunks//2,
                needed.eq(rounded[10:])
            ),
            write.adr.eq(self.slot),
            write.dat_w.eq(Cat(self.frame_id, self.base, self.pixels, needed)),
            write.we.eq(self.open),
            read.adr.eq(self.index),
            self.frame.raw_bits().eq(read.dat_r),
        ]
        self.sync += If(self.open, chunks.eq(needed))
        return chunks

    def add_opened(self, cleared):
        """Open and close slots."""
        for n, opened in enumerate(self.opened):
            self.sync += [
                If(cleared & (self.pending == n),
                    opened.eq(self.wanted)
                ),
                If((self.open | self.close) & (self.slot == n),
                    opened.eq(0)
                ),
            ]

    def add_missing(self, chunks):
        """Count what the slots lack: from the chunks of a frame, while its slot is cleared, down to 0."""
        memory        = Memory(self.index_bits, 2**len(self.index), name="slot_missing")
        write         = memory.get_port(write_capable=True)
        read          = memory.get_port(async_read=True)
        software_port = memory.get_port(async_read=True)
        self.specials += memory, write, read, software_port
        self.comb += [
            read.adr.eq(self.found),
            software_port.adr.eq(self.arrived_index[log2_int(self.words):]),
            write.we.eq(self.set | self.clearing),
            If(self.set,
                write.adr.eq(self.found),
                write.dat_w.eq(read.dat_r - 1)
            ).Else(
                write.adr.eq(self.pending),
                write.dat_w.eq(Cat(C(0, 1), chunks))
            ),
        ]
        self.sync += self.missing.eq(software_port.dat_r)

    def add_verdict(self):
        """Judge a chunk: search its frame, a slot per clock, then take a register after each step; begin again while a
        bitmap is being cleared.

        In step 0 the slots are searched. The chunk's word of the bitmap is addressed in step 1, leaves the memory in
        step 2, and is in `shown` from step 3 on, where the verdict reads it.
        """
        steps    = 4
        step     = Signal(max=steps + 1)
        finished = Signal()
        hit      = Signal() # The slot is open for the chunk's frame; ids are unique.
        number, inside, expected = self.add_place()
        word = Signal(max=len(self.opened)*self.words)
        self.comb += [
            hit.eq(Array(self.opened)[self.index] & (self.frame.frame_id == self.chunk.frame_id)),
            word.eq(Cat(number[5:5 + log2_int(self.words)], self.index)),
            self.chunk.judged.eq(step == steps),
            finished.eq(step == steps - 1),
        ]
        self.sync += [
            If(~self.chunk.judge | self.clearing,
                step.eq(0),
                self.index.eq(0)
            ).Elif((step == 0) & ~hit & (self.index != len(self.opened) - 1),
                self.index.eq(self.index + 1)
            ).Elif(~self.chunk.judged,
                step.eq(step + 1)
            ),
            # It holds until the chunk is marked: by then its slot may have been closed, and `word` be of another one.
            If(self.chunk.judge & ~finished & ~self.chunk.judged,
                self.chunk_word.eq(word)
            ),
            If(finished,
                self.chunk.fits.eq(
                    hit & inside & (self.chunk.offset[:10] == 0) & (self.chunk.length == expected)),
                self.found.eq(self.index),
                self.address.eq(self.frame.base + self.chunk.offset),
                self.chunk.repeated.eq((self.shown >> number[:5]) & 1),
                self.marked.eq(self.shown | (1 << number[:5]))
            ),
        ]

    def add_place(self):
        """Find the chunk in its image. Return its number in the frame, whether the frame has it, and its length."""
        number    = Signal(22) # Of the chunk in the frame,
        beyond    = Signal(22) # in the right image,
        local     = Signal(22) # and in its own image.
        inside    = Signal()
        before    = Signal(32) # Pixels of the image before the chunk,
        remaining = Signal(32) # and from its begin to the image's end.
        expected  = Signal(11)
        self.comb += [
            number.eq(self.chunk.offset[10:]),
            beyond.eq(number - self.frame.chunks),
            before.eq(Cat(C(0, 10), local)),
        ]
        self.sync += [
            local.eq(Mux(number < self.frame.chunks, number, beyond)),
            inside.eq(number < Cat(C(0, 1), self.frame.chunks)),
            remaining.eq(self.frame.pixels - before),
            expected.eq(Mux(remaining < CHUNK_BYTES, remaining, CHUNK_BYTES)),
        ]
        return number, inside, expected
