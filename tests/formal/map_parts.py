#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MapParts: parts that found room are sent whole, once and in order; the map never waits."""

from __future__ import annotations

from types import SimpleNamespace

from migen import C, Cat, If, Memory, Mux, Signal

from litestereo.gateware.link.map_parts import MapParts
from litestereo.gateware.link.message import REPLY_BIT, TYPE_READ

from .proof import Proof, inside, smaller
from .streams import counted, feed, queue, sound, stays, stored, taken

PARTS = 2
CHUNK = 8 # Bytes of a part: two words, or four pixels.


def map_parts(make=MapParts) -> Proof:
    """Prove maps of any size, aborted at any time; the arbiter sends messages at any time."""
    core  = smaller(make, CHUNK_BYTES=CHUNK)(parts=PARTS)
    proof = Proof(core)
    sink, source, payload, job = core.sink, core.source, core.payload, core.job
    feed(proof, sink)
    proof.free(core.open, core.close, core.taken, source.ready, payload.ready, *job.flatten())

    # Reference count of the current map.
    under = Signal()
    comes = sink.valid & under
    pixel = counted(proof, comes, core.open, 31)
    proof.sync += [
        If(comes & sink.last,
            under.eq(0)
        ),
        If(core.open,
            under.eq(1)
        ),
        If(core.close,
            under.eq(0)
        ),
    ]
    proof.assume("a map begins when the one before is over, and sent", ~core.open | ~(under | core.sending))
    header = {name: Signal(bits) for name, bits in job.layout}
    proof.sync += If(core.open, [signal.eq(getattr(job, name)) for name, signal in header.items()])

    # Parts that found room at their first pixel and are not yet sent or discarded.
    given = Signal() # The waiting part was aborted.
    drops = given & ~core.taken & core.sending
    kept  = Signal()
    keep  = Signal()
    ends  = comes & (sink.last | (pixel[:2] == 3))
    item  = Cat(C(0, 3), pixel[2:], C(0, 1), pixel[:2] + C(1, 3))
    items, level = queue(proof, ends & keep, item, taken(source) | drops, PARTS)
    proof.comb += keep.eq(Mux(pixel[:2] == 0, level < PARTS, kept))
    proof.sync += [
        If(comes,
            kept.eq(keep)
        ),
        If(core.close,
            given.eq(1)
        ).Elif(~core.sending,
            given.eq(0)
        ),
    ]

    # MessageArbiter accepts an offered message until it is sent, MessageFramer accepts its payload first.
    words = Signal(2)
    proof.comb += words.eq((items[0][32:] + 2) >> 2)
    word   = counted(proof, taken(payload), taken(source), 2)
    before = proof.past(core.taken)
    sent   = proof.past(taken(source))
    proof.assume("what is taken was offered", ~core.taken | before | proof.past(source.valid))
    proof.assume("it is taken until it is sent", ~before | (core.taken == ~sent))
    proof.assume("nothing else is sent", core.taken | ~(source.ready | payload.ready))
    proof.assume("a message after its payload", ~taken(source) | (word == words))
    proof.assume("and no other payload", ~taken(payload) | (word < words))

    proof.prove("the map never waits", sink.ready)
    proof.prove("parts wait until they are sent or discarded", core.sending == (level != 0))
    proof.prove("messages are the parts with room, in order", ~source.valid | ((level != 0)
                & (source.offset == items[0][:32]) & (source.length == items[0][32:])))
    for name, signal in header.items():
        proof.prove(f"{name} is the map's", ~source.valid | (getattr(source, name) == signal))
    proof.prove("they are parts of maps", ~source.valid | (source.type == TYPE_READ | REPLY_BIT))
    proof.prove("what is offered stays, or is given up", stays(proof, source) | (given & ~core.taken))
    proof.prove("what is taken stays", ~core.taken | source.valid)
    proof.prove("its payload is there a clock later, and stays", ~(core.taken & before)
                | (payload.valid & stays(proof, payload)))
    proof.prove("nothing of a map that was given up is offered", ~source.valid | ~given | core.taken)
    late = counted(proof, drops, ~given, 2)
    proof.prove("it is discarded soon", late <= PARTS)

    # One arbitrary word of one arbitrary map.
    which, data, any_map = proof.constant(30), proof.constant(32), proof.port("free_map", 1)
    proof.widths["free_map"] = 1
    marked = Signal()
    proof.sync += If(core.open, marked.eq(any_map))
    proof.assume("the word holds the data", ~comes | ~marked | (pixel[1:] != which)
                 | (sink.disparity == Mux(pixel[0], data[16:], data[:16])))
    place = Signal(30)
    proof.comb += place.eq(source.offset[2:] + word)
    half  = (source.length[1]) & (word == words - 1)
    proof.prove("the payload is what the map holds there", ~payload.valid | (word == words) | ~marked | (place != which)
                | ((payload.data[:16] == data[:16]) & (half | (payload.data[16:] == data[16:]))))
    over = ~under & ~core.sending
    proof.reach("a map of two parts and a pixel is sent, but for what finds no room", over & ~given & (pixel == 9)
                & (counted(proof, taken(source), core.open, 3) == 2))
    proof.reach("a message that is being sent goes on when its map is given up", given & taken(source))
    invariants(proof, core, SimpleNamespace(
        under=under, pixel=pixel, kept=kept, given=given, items=items, level=level, words=words, word=word, late=late,
        which=which, data=data, marked=marked))
    return proof


def invariants(proof: Proof, core: MapParts, ghost: SimpleNamespace) -> None:
    """State the invariants of the registers, for the induction."""
    named = {name: inside(core, name)[0] for name in
             ("active", "place", "omitted", "dropping", "first", "index", "there", "loaded")}
    own   = {len(signal): signal for name in ("offset", "pixel", "held") for signal in inside(core, name)}
    fifo  = core.fifo
    pixel, items, level, which, data = ghost.pixel, ghost.items, ghost.level, ghost.which, ghost.data
    begun = ghost.under & (pixel[:2] != 0)
    sound(proof, fifo)
    proof.prove("the FIFO holds the parts", fifo.level == level)
    for n, item in enumerate(items):
        proof.prove(f"part {n}", (n >= level) | ((stored(proof, fifo, n)[:43] == item) & (item[:3] == 0)
                    & ~item[32] & (item[32:] != 0) & (item[32:] <= CHUNK)))
    proof.prove("pixels are counted", named["active"] == ghost.under)
    proof.prove("and lie in a part", ~ghost.under | ((own[2] == pixel[:2]) & (own[32][3:] == pixel[2:])
                                                     & (own[32][:3] == 0)))
    proof.prove("it is kept or left out", ~begun | (named["omitted"] == ~ghost.kept))
    proof.prove("with room after those that wait", ~begun | ~ghost.kept | (level < PARTS))
    proof.prove("there is its place", named["place"] == (named["first"] ^ level[0]))
    proof.prove("given up is known", named["dropping"] == ghost.given)
    clocks = Signal(4)
    proof.comb += clocks.eq(ghost.late + level)
    proof.prove("and discarded one after the other", ~ghost.given | (clocks <= PARTS))
    proof.prove("without any more", ~(ghost.given & ghost.under))
    proof.prove("words are counted", named["index"] == ghost.word[0] ^ named["loaded"])
    proof.prove("of the message that is taken", (ghost.word == 0) | core.taken)
    proof.prove("no more than it has", ~core.taken | (ghost.word <= ghost.words))
    proof.prove("shown when it waits", ~(named["there"] | named["loaded"]) | (level != 0))
    proof.prove("loaded after it was shown", ~named["loaded"] | named["there"])

    proof.prove("a clock after the offer", ~proof.past(core.source.valid) | proof.past(taken(core.source))
                | named["there"])
    proof.prove("and loaded another one later", ~(core.taken & proof.past(core.taken)) | named["loaded"])

    # The word in memory, in any part.
    memory = next(special for special in core._fragment.specials
                  if isinstance(special, Memory) and special.name_override == "map_parts")
    words  = []
    for place in range(PARTS):
        port = memory.get_port(async_read=True)
        proof.specials += port
        proof.comb += port.adr.eq(Cat(which[0], named["first"] + place))
        words.append(port.dat_r)
    shows = memory.ports[1].dat_r
    for name, valid, word, value in [("what memory shows is in it", named["there"], named["index"], shows),
                                     ("what is loaded as well", named["loaded"], ghost.word[0], core.payload.data)]:
        port = memory.get_port(async_read=True)
        proof.specials += port
        proof.comb += port.adr.eq(Cat(word, named["first"]))
        proof.prove(name, ~valid | (value == port.dat_r))
    for n, item in enumerate(items):
        low  = which[0] & (item[32:] <= 4) # After the end of the part.
        half = (item[32:] == Mux(which[0], 6, 2))
        proof.prove(f"memory holds the word of part {n}", (n >= level) | ~ghost.marked | (item[3:32] != which[1:]) | low
                    | ((words[n][:16] == data[:16]) & (half | (words[n][16:] == data[16:]))))
    pending = begun & ghost.kept & ghost.marked & (pixel[2:] == which[1:])
    proof.prove("and of the part under way", ~pending | (pixel[:2] <= Cat(1, which[0]))
                | (Mux(level[0], words[1], words[0]) == data))
    proof.prove("the pixel before is held", ~pending | (pixel[:2] != Cat(1, which[0])) | (own[16] == data[:16]))
    shown = Signal(30)
    proof.comb += shown.eq(items[0][2:32] + ghost.word)
    half = items[0][33] & (ghost.word == ghost.words - 1)
    proof.prove("the word is loaded", ~named["loaded"] | (level == 0) | ~ghost.marked | (ghost.word == ghost.words)
                | (shown != which) | ((core.payload.data[:16] == data[:16])
                                      & (half | (core.payload.data[16:] == data[16:]))))
