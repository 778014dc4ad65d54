#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SlotTable: an accepted chunk lies inside its frame's image; its bit is marked, and no other."""

from __future__ import annotations

from migen import Array, C, Cat, If, Memory, Mux, Record, Signal

from litestereo.gateware.link.message import CHUNK_BYTES
from litestereo.gateware.link.slot_table import SlotTable

from .proof import Proof, inside

SLOTS  = 2
CHUNKS = 64


def slot_table(make=SlotTable) -> Proof:
    """Prove slots opened and closed at any time, and chunks of any offset and length, judged as in MessageSorter."""
    core  = make(slots=SLOTS, max_chunks=CHUNKS)
    proof = Proof(core)
    chunk = core.chunk
    asked = [chunk.frame_id, chunk.offset, chunk.length]
    proof.free(core.slot, core.frame_id, core.base, core.pixels, core.open, core.close, *asked, chunk.judge, core.set,
               core.arrived_index)
    frames = [frame_of(proof, core, n) for n in range(SLOTS)]
    before = proof.past(chunk.judge)
    for field in asked:
        proof.assume("what is judged holds", ~(before & chunk.judge) | (field == proof.past(field)))
    proof.assume("and until the verdict is there", ~before | chunk.judge | proof.past(chunk.judged))
    proof.assume("a slot is not opened while one is cleared", ~core.open | ~core.clearing)
    proof.assume("slots and frames are legal", (core.slot < SLOTS) & (core.pixels != 0) & (core.pixels < 2**30))
    # The firmware closes a slot, and waits until no chunk of it is being written, before it opens the slot again.
    for n in range(SLOTS):
        clocks = Signal(4, reset=10)
        proof.sync += If(inside(core, f"opened{n}")[0], clocks.eq(0)).Elif(clocks != 10, clocks.eq(clocks + 1))
        proof.assume(f"slot {n} is opened some clocks after its closing", ~core.open | (core.slot != n)
                     | (clocks == 10))
        proof.assume(f"no other frame has the id of slot {n}'s", ~core.open | (core.slot == n)
                     | ~inside(core, f"opened{n}")[0] | (core.frame_id != frames[n].frame_id))
    ready = Signal()  # A verdict that accepts a chunk and is not used yet.
    proof.sync += If(chunk.judged & chunk.judge, ready.eq(chunk.fits & ~chunk.repeated)).Elif(core.set | chunk.judge,
                                                                                         ready.eq(0))
    proof.assume("a chunk is marked when it was allowed, once", ~core.set | (ready & ~chunk.judge))

    allowed = chunk.judge & chunk.judged & chunk.fits
    bases   = Array(frame.base for frame in frames)
    pixels  = Array(frame.pixels for frame in frames)
    ids     = Array(frame.frame_id for frame in frames)
    base, size, frame_id, rounded, pitch, local, offset = (
        Signal(32, name_override=f"found_{name}")
        for name in ("base", "size", "frame_id", "rounded", "pitch", "local", "offset"))
    slot = core.found[0]
    proof.comb += [
        base.eq(bases[slot]), size.eq(pixels[slot]), frame_id.eq(ids[slot]),
        rounded.eq(size + CHUNK_BYTES - 1),
        pitch.eq(Cat(C(0, 10), rounded[10:])),
        offset.eq(core.address - base),
        local.eq(Mux(offset < pitch, offset, offset - pitch)),
    ]
    end = Signal(35)
    proof.comb += end.eq(local + chunk.length)
    proof.prove("a chunk that fits is of the slot's frame", ~allowed | ((core.found < SLOTS)
                & (frame_id == chunk.frame_id)))
    proof.prove("and lies inside one of its images", ~allowed | (end <= size))
    proof.prove("where its offset says", ~allowed | (offset == chunk.offset))
    proof.prove("and is not empty", ~allowed | (chunk.length != 0))
    judging = proof.past(chunk.judge & ~chunk.judged)
    verdict = [chunk.fits, chunk.repeated, core.found, core.address]
    for value in verdict:
        proof.prove("a verdict stays until the next", ~proof.started | judging | (value == proof.past(value)))
    bitmaps(proof, core, allowed)
    proof.reach("a chunk fits", allowed & (chunk.length == 5))
    proof.reach("it is marked", core.set)
    proof.reach("it is marked while a slot is cleared", core.set & core.clearing)
    return proof


def memory_of(core: SlotTable, name: str) -> Memory:
    """Return a memory of the core."""
    return next(special for special in core._fragment.specials
                if isinstance(special, Memory) and special.name_override == name)


def frame_of(proof: Proof, core: SlotTable, slot: int) -> Record:
    """Return the frame in a slot."""
    frame = Record(core.frame.layout)
    port  = memory_of(core, "slot_frames").get_port(async_read=True)
    proof.specials += port
    proof.comb     += [port.adr.eq(slot), frame.raw_bits().eq(port.dat_r)]
    return frame


def bitmaps(proof: Proof, core: SlotTable, allowed) -> None:
    """Prove what becomes of any word of the bitmaps: the solver chooses which."""
    words  = CHUNKS//32
    port   = memory_of(core, "arrived_chunks").get_port(async_read=True)
    place  = proof.constant(len(port.adr))
    chosen = Signal.like(port.adr)
    proof.specials += port
    proof.comb     += [chosen.eq(place), port.adr.eq(chosen)]
    now    = port.dat_r
    before = proof.past(now)
    # Word and bit of the chunk that was allowed last.
    number = Signal(len(chosen) + 5)
    latest = Signal.like(number)
    mine   = Signal()
    bit    = Signal(32)
    proof.sync += If(allowed, latest.eq(number))
    proof.comb += [
        number.eq(Cat(core.chunk.offset[10:15 + words.bit_length() - 1], core.found)),
        mine.eq(latest[5:] == chosen),
        bit.eq(1 << latest[:5]),
    ]
    pending = inside(core, "pending")[0]
    cleared = Signal()
    proof.comb += cleared.eq(core.clearing & (pending == chosen[words.bit_length() - 1:]))
    marked = proof.past(core.set)
    proof.prove("a set marks the bit of its chunk", ~marked | ~proof.past(mine) | (now == (before | proof.past(bit))))
    proof.prove("and nothing else", ~marked | proof.past(mine) | (now == before))
    proof.prove("without a set only a slot that is being cleared changes", ~proof.started | marked
                | proof.past(cleared) | (now == before))
    proof.prove("clearing marks nothing", ~proof.started | marked | (now == before) | (now == 0))
    asked = Signal()
    proof.comb += asked.eq(now >> number[:5])
    proof.prove("a chunk is repeated if it is marked", ~allowed | (number[5:] != chosen)
                | (core.chunk.repeated == asked))
