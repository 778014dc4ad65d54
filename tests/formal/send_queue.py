#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SendQueue: all messages of a job are sent, each once, in order, and each only once its payload is there."""

from __future__ import annotations

from types import SimpleNamespace

from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Cat, If, Memory, Mux, Signal

from litestereo.gateware.link.message import job_layout
from litestereo.gateware.link.send_queue import SendQueue

from .proof import Proof, inside, smaller
from .streams import counted, feed, held, stays, taken

CHUNK = 8 # Bytes of a message's payload, at most; the FIFO holds two payloads.
WORDS = CHUNK//4

#: Numbers of few bits: the arithmetic is the same, and the solver is faster.
BITS = 10
#: A mark that the core copies like any other field: it tells the messages of one job from all others.
LAYOUT = [*((name, min(bits, BITS)) for name, bits in job_layout()), ("mark", 1)]
#: Fields that all messages of a job share.
COMMON = [name for name, _ in LAYOUT if name not in ("offset", "base", "length")]


class Reader(LiteXModule):
    """A StreamReader, as it is proven elsewhere: as many words as the block has, of any contents, then idle."""

    def __init__(self) -> None:
        self.source = stream.Endpoint([("data", 32)])
        self.base, self.length = Signal(BITS), Signal(BITS)
        self.start, self.idle  = Signal(), Signal()
        self.remaining = Signal(BITS)  # Words that remain.
        rounded        = Signal(BITS + 1)
        self.comb += [rounded.eq(self.length + 3), self.idle.eq(self.remaining == 0)]
        self.sync += [
            If(taken(self.source),
                self.remaining.eq(self.remaining - 1)
            ),
            If(self.start & self.idle,
                self.remaining.eq(rounded[2:])
            ),
        ]


def send_queue(make=SendQueue) -> Proof:
    """Prove replies and bursts of any length and address, at any time; bursts aborted; memory and wire that stall."""
    reader = Reader()
    core   = smaller(make, CHUNK_BYTES=CHUNK, PAYLOAD_WORDS=2*WORDS, job_layout=lambda: LAYOUT)(reader)
    proof  = Proof(core)
    proof.submodules += reader
    source, payload, job = core.source, core.payload, core.job
    feed(proof, reader.source)
    proof.free(source.ready, payload.ready, core.reply, core.burst, core.abort, *job.flatten())
    proof.assume("words come in a block alone", ~reader.source.valid | ~reader.idle)
    proof.assume("a job is either a reply or a burst",     ~(core.reply & core.burst))
    proof.assume("bases are aligned",                    job.base[:2] == 0)
    proof.assume("a reply is one message",               ~core.reply | (job.length <= CHUNK))
    proof.assume("a burst is shorter than half of memory", job.length < 2**(BITS - 1))
    accepted = [core.reply & ~core.reply_busy, core.burst & ~core.burst_busy]

    # MessageFramer accepts a payload only after its message.
    words = rounded(proof, source.length)
    word  = counted(proof, taken(payload), taken(source), 8)
    proof.assume("words are taken of the message that is offered", ~taken(payload) | (source.valid & (word < words)))
    proof.assume("and the message after them", ~taken(source) | (word == words))

    proof.prove("what is offered stays", stays(proof, source))
    proof.prove("and so does its payload", stays(proof, payload))
    queued = Signal(8)  # Words in the FIFO, and the one that is shown.
    proof.comb += queued.eq(core.fifo.level + payload.valid)
    proof.prove("a message is offered when all of its payload is in the queue",
                ~source.valid | (word + queued >= words))
    proof.prove("its payload never waits", ~source.valid | (word == words) | payload.valid)
    proof.prove("the reader never waits for room", reader.idle | core.fifo.sink.ready)
    proof.prove("a message is of 1024 bytes at most", ~source.valid | (source.length <= CHUNK))

    # What is being read.
    reads = proof.past(reader.start) | ~reader.idle
    proof.prove("the reader is started when it is idle, for a byte at least, at a whole word",
                ~reader.start | (reader.idle & (reader.length != 0) & (reader.base[:2] == 0)))
    proof.prove("base and length hold while it reads",
                held(proof, reader.base, reads) & held(proof, reader.length, reads))
    blocks = [block(proof, reader, job, accept) for accept in accepted]
    proof.prove("no address outside of [base, base + length) of a job", ~reader.start
                | (core.reply_busy & blocks[0].inside) | (core.burst_busy & blocks[1].inside))
    which, data    = proof.constant(32), proof.constant(32)
    pushed, popped = counted(proof, taken(reader.source), 0), counted(proof, taken(payload), 0)
    proof.assume("the word holds the data", ~taken(reader.source) | (pushed != which) | (reader.source.data == data))
    proof.prove("words leave as they were read, in order", ~payload.valid | (popped != which)
                | (payload.data == data))

    marked = one_job(proof, core, accepted)
    # Clocks in which the queue waits neither for memory nor for the wire.
    offered  = core.offered.sink
    moves    = reader.idle & ~(offered.valid & ~offered.ready)
    any_busy = core.reply_busy | core.burst_busy
    calm     = counted(proof, moves, taken(offered) | inside(core, "given_up")[0] | ~any_busy, 4)
    proof.prove("there is always a next step", ~any_busy | (calm <= 3))
    chosen   = inside(core, "chosen")[0]
    before   = counted(proof, taken(offered) & core.reply_busy, accepted[0], 3)
    proof.prove("a reply waits for one message at most", ~core.reply_busy | (before <= 1))
    stopped  = Signal()
    late     = counted(proof, reader.idle, core.abort & core.burst_busy & ~stopped, 4)
    proof.sync += If(core.abort & core.burst_busy, stopped.eq(1)).Elif(accepted[1], stopped.eq(0))
    proof.prove("a burst that was given up reads no further message", ~reader.start | ~chosen | ~stopped)
    proof.prove("and ends when the present one is read, even if the wire stalls",
                ~core.burst_busy | ~stopped | (late <= 3))

    invariants(proof, core, reader, SimpleNamespace(
        words=words, word=word, queued=queued, which=which, data=data, pushed=pushed, popped=popped, blocks=blocks,
        marked=marked, calm=calm, before=before, stopped=stopped, late=late, chosen=chosen))
    return proof


def rounded(proof: Proof, length: Signal) -> Signal:
    """Return the words that so many bytes fill."""
    bytes, words = Signal(BITS + 1), Signal(BITS - 1)
    proof.comb += [bytes.eq(length + 3), words.eq(bytes[2:])]
    return words


def block(proof: Proof, reader: Reader, job, accept) -> SimpleNamespace:
    """Return the memory of the job accepted last, and whether the reader is inside."""
    base, length, offset, end = (Signal(bits) for bits in (BITS, BITS, BITS, BITS + 1))
    proof.sync += If(accept, base.eq(job.base), length.eq(job.length))
    proof.comb += [offset.eq(reader.base - base), end.eq(offset + reader.length)]
    return SimpleNamespace(base=base, length=length, inside=end <= length)


def one_job(proof: Proof, core: SendQueue, accepted: list) -> SimpleNamespace:
    """Mark one arbitrary job: its messages cover it from the first byte to the last, each once, in order."""
    source, job = core.source, core.job
    fields = {name: Signal(bits) for name, bits in LAYOUT}
    known, burst, given, running = Signal(), Signal(), Signal(), Signal()
    begins = (accepted[0] | accepted[1]) & job.mark
    proof.assume("one job is marked", ~begins | ~known)
    proof.sync += [
        If(begins,
            known.eq(1),
            burst.eq(accepted[1]),
            [signal.eq(getattr(job, name)) for name, signal in fields.items()]
        ),
        If(accepted[1],
            running.eq(job.mark)
        ),
        If(core.abort & core.burst_busy & running,
            given.eq(1)
        ),
    ]
    leaves = taken(source) & source.mark
    sent   = Signal(BITS)  # Bytes of whole messages.
    proof.sync += If(leaves, sent.eq(sent + CHUNK))

    def part(message: dict[str, Signal], begin: Signal):
        """Return whether the message is the job's part from `begin` on."""
        offset    = Signal(BITS)
        base      = Signal(BITS)
        remaining = Signal(BITS)
        proof.comb += [offset.eq(fields["offset"] + begin), base.eq(fields["base"] + begin),
                       remaining.eq(fields["length"] - begin)]
        condition = (known & (message["offset"] == offset) & (message["base"] == base)
                     & (message["length"] == Mux(remaining > CHUNK, CHUNK, remaining))
                     & ((begin == 0) | (burst & (begin < fields["length"]))))
        for name in COMMON:
            condition = condition & (message[name] == fields[name])
        return condition

    offered = {name: getattr(source, name) for name, _ in LAYOUT}
    proof.prove("its messages are its parts, one after the other, with all fields", ~(source.valid & source.mark)
                | part(offered, sent))
    at_rest = ~core.reply_busy & ~core.burst_busy & ~source.valid & (core.fsm.state == core.fsm.encoding["CHOOSE"])
    proof.prove("all of them have left in the end, unless it was given up",
                ~at_rest | ~known | given | ((sent != 0) & (sent >= fields["length"])))
    proof.prove("a reply leaves once", ~known | burst | (sent <= CHUNK))
    proof.reach("a burst of two messages has left", at_rest & known & burst & (sent == 2*CHUNK)
                & (fields["length"] == CHUNK + 1))
    proof.reach("a burst is given up after its first message", at_rest & given & (sent == CHUNK)
                & (fields["length"] > CHUNK))
    proof.reach("a reply has left before the end of a burst", known & ~burst & (sent != 0) & core.burst_busy)
    return SimpleNamespace(fields=fields, known=known, burst=burst, given=given, running=running, sent=sent, part=part)


def invariants(proof: Proof, core: SendQueue, reader: Reader, ghost: SimpleNamespace) -> None:
    """State the invariants of the registers, for the induction."""
    fsm, source, marked = core.fsm, core.source, ghost.marked
    state   = {name: fsm.state == number for name, number in fsm.encoding.items()}
    records = {record: {name: inside(core, f"{record}_{name}")[0] for name, _ in LAYOUT}
               for record in ("message", "burst_job", "reply_job")}
    message, burst, reply = records.values()
    chosen  = ghost.chosen
    waits   = state["ROOM"] | state["READ"] # The job waits for the message to be sent.
    begun   = waits | state["OFFER"]

    # Jobs, and the message that is made of one.
    part = Signal.like(burst["length"])
    proof.comb += part.eq(Mux(burst["length"] > CHUNK, CHUNK, burst["length"]))
    of_burst, of_reply = (Cat(*(message[name] == job[name] for name, _ in LAYOUT)) == 2**len(LAYOUT) - 1
                        for job in ({**burst, "length": part}, reply))
    proof.prove("four states", fsm.state < 4)
    proof.prove("a message is of its job", ~waits | Mux(chosen, core.burst_busy & of_burst, core.reply_busy & of_reply))
    proof.prove("a message has its size", ~begun | (message["length"] <= CHUNK))
    proof.prove("and so has a reply", ~core.reply_busy | (reply["length"] <= CHUNK))
    for name, job, busy, memory in [("reply", reply, core.reply_busy, ghost.blocks[0]),
                                    ("burst", burst, core.burst_busy, ghost.blocks[1])]:
        offset = Signal(BITS)
        end    = Signal(BITS + 1)
        proof.comb += [offset.eq(job["base"] - memory.base), end.eq(offset + job["length"])]
        proof.prove(f"the {name} ends with its block", ~busy | ((end == memory.length) & (job["base"][:2] == 0)))
        proof.prove(f"and is shorter than half of memory, as the {name} was", memory.length < 2**(BITS - 1))

    # Words.
    held_by = rounded(proof, message["length"])
    inner   = core.fifo.fifo.fifo
    output  = core.fifo.fifo.readable
    ahead   = Signal(8)
    proof.comb += ahead.eq(Mux(source.valid, ghost.words, 0) + Mux(state["OFFER"], held_by, 0)
                           + Mux(state["READ"], held_by - reader.remaining, 0))
    proof.prove("words are of messages that leave, wait or are read",
                ghost.queued + ghost.word == ahead)
    proof.prove("no more are taken than a message has", Mux(source.valid, ghost.word <= ghost.words, ghost.word == 0))
    proof.prove("reading in one state", Mux(state["READ"], (reader.remaining <= held_by) & (held_by != 0), reader.idle))
    proof.prove("room is there at once", ~state["ROOM"] | inside(core, "room")[0])
    produce, consume = inside(inner, "produce")[0], inside(inner, "consume")[0]
    distance = Signal.like(produce)
    proof.comb += distance.eq(produce - consume)
    proof.prove("the FIFO's level is its pointers' distance", (distance == inner.level[:len(distance)])
                & (inner.level <= inner.depth))
    payload = core.payload
    gone    = ghost.word + payload.valid  # Of the message that is offered, words that have left the FIFO.
    proof.prove("a word leaves the FIFO's memory a clock after it came", output | (inner.level == 0) | (
        (inner.level == 1) & state["READ"] & (~source.valid | (gone >= ghost.words))))
    proof.prove("and is shown two clocks later", payload.valid | (core.fifo.level == 0) | (
        (~source.valid | (ghost.word == ghost.words)) & Mux(
            state["READ"], core.fifo.level <= 2, state["OFFER"] & output & (inner.level == 0))))
    inside_fifo = Signal(32)
    place       = Signal(32)
    address     = Signal.like(consume)
    storage = next(special for special in core.fifo._fragment.specials if isinstance(special, Memory))
    port    = storage.get_port(async_read=True)
    proof.specials += port
    proof.comb += [inside_fifo.eq(ghost.pushed - ghost.popped - payload.valid),
                   place.eq(ghost.which - ghost.popped - payload.valid),
                   address.eq(consume + place - output), port.adr.eq(address)]
    proof.prove("words are counted", inside_fifo == core.fifo.level)
    proof.prove("the FIFO holds the word", (place >= core.fifo.level) | Mux(
        output & (place == 0), core.fifo.source.data == ghost.data, port.dat_r[:32] == ghost.data))

    # The marked job.
    leaving = source.valid & source.mark
    going   = state["OFFER"] & message["mark"]
    second  = Signal(BITS)
    read    = Signal(BITS)
    proof.comb += [second.eq(marked.sent + Mux(leaving, CHUNK, 0)), read.eq(second + Mux(going, CHUNK, 0))]
    fields = marked.fields
    offset    = Signal(BITS)
    base      = Signal(BITS)
    remaining = Signal(BITS)
    proof.comb += [offset.eq(fields["offset"] + read), base.eq(fields["base"] + read),
                   remaining.eq(fields["length"] - read)]
    rest = marked.known & marked.burst & (burst["length"] == remaining) & ((read == 0) | (read < fields["length"]))
    for name, signal in burst.items():
        rest = rest & (signal == {**fields, "offset": offset, "base": base, "length": remaining}[name])
    proof.prove("the burst is what was not read of it", ~core.burst_busy | ~burst["mark"] | rest)
    all_of_it = marked.known & ~marked.burst & (read == 0)
    for name, signal in reply.items():
        all_of_it = all_of_it & (signal == fields[name])
    proof.prove("the reply is all of it", ~core.reply_busy | ~reply["mark"] | all_of_it)
    proof.prove("what waits to leave is its part", ~going | marked.part(message, second))
    own = Mux(marked.burst, core.burst_busy & burst["mark"], core.reply_busy & reply["mark"])
    proof.prove("until all is read it is under way", ~marked.known | marked.given | own
                | ((read != 0) & (read >= fields["length"])))
    proof.prove("nothing is sent of no job", marked.known | (read == 0))
    proof.prove("of a reply once", ~marked.known | marked.burst | (read <= CHUNK))
    proof.prove("it is shorter than half of memory", fields["length"] < 2**(BITS - 1))
    proof.prove("a reply is short", ~marked.known | marked.burst | (fields["length"] <= CHUNK))
    proof.prove("the mark is its own", fields["mark"] == marked.known)
    proof.prove("the burst has its mark", ~core.burst_busy | (marked.running == burst["mark"]))
    proof.prove("a burst of it is given up alone", ~marked.given | (marked.known & marked.burst))
    aborted = inside(core, "aborted")[0]
    proof.prove("given up is known", ~core.burst_busy | (ghost.stopped == aborted))
    proof.prove("and of the marked one too", ~core.burst_busy | ~burst["mark"] | (marked.given == aborted))

    # Clocks.
    proof.prove("a step at a time", ~(core.reply_busy | core.burst_busy) | state["OFFER"]
                | (ghost.calm <= state["ROOM"] + 2*state["READ"]))
    proof.prove("with an end", ~state["OFFER"] | (ghost.calm <= 3))
    proof.prove("then the reply's turn", ~core.reply_busy
                | (ghost.before + (state["OFFER"] | (waits & chosen)) <= 1))
    steps = Signal(3) # Until an aborted burst ends.
    proof.comb += steps.eq(Mux(state["CHOOSE"], Mux(core.reply_busy, 4, 1), Mux(
        state["ROOM"], Mux(chosen, 1, 3), Mux(state["READ"], 2, 1))))
    proof.prove("a burst that was given up comes to its end", ~core.burst_busy | ~ghost.stopped
                | (ghost.late + steps <= 4))
