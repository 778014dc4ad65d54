#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The contract of streams, docs/interfaces.md: an offered item is stable until it is accepted."""

from __future__ import annotations

from litex.soc.interconnect.stream import Endpoint, SyncFIFO
from migen import Cat, If, Memory, Signal, log2_int

from .proof import Proof, inside


def stays(proof: Proof, endpoint: Endpoint, marks: bool = True):
    """Return the condition that what was offered a clock ago and not accepted is still offered."""
    fields  = [*endpoint.payload.flatten(), *endpoint.param.flatten()]
    payload = Cat(*fields, *([endpoint.first, endpoint.last] if marks else []))
    offered = Signal(len(payload))
    waiting = Signal()
    proof.sync += waiting.eq(endpoint.valid & ~endpoint.ready)
    proof.sync += offered.eq(payload)
    return ~waiting | (endpoint.valid & (offered == payload))


def feed(proof: Proof, endpoint: Endpoint) -> None:
    """Offer any items to a sink, within the contract."""
    proof.free(endpoint.valid, endpoint.first, endpoint.last, *endpoint.payload.flatten(), *endpoint.param.flatten())
    proof.assume("the sink's source keeps the contract", stays(proof, endpoint))


def taken(endpoint: Endpoint):
    """Return whether an item is transferred."""
    return endpoint.valid & endpoint.ready


def counted(proof: Proof, event, clear, bits: int = 32) -> Signal:
    """Return how often `event` has happened before this clock, since the clock of `clear`."""
    count = Signal(bits)
    proof.sync += [
        If(event,
            count.eq(count + 1)
        ),
        If(clear,
            count.eq(0)
        ),
    ]
    return count


def raster_position(proof: Proof, moves, width, begin) -> tuple[Signal, Signal]:
    """Return column and row of the next pixel, in rows of `width` pixels, since the clock of `begin`."""
    column = Signal(8)
    row    = Signal(8)
    proof.sync += [
        If(moves,
            column.eq(column + 1),
            If(column == width - 1,
                column.eq(0),
                row.eq(row + 1)
            )
        ),
        If(begin,
            column.eq(0),
            row.eq(0)
        ),
    ]
    return column, row


def held(proof: Proof, signal: Signal, busy):
    """Return the condition that a setting does not change in a clock in which `busy` is 1."""
    before = Signal.like(signal)
    proof.sync += before.eq(signal)
    return ~proof.started | ~busy | (signal == before)


def sound(proof: Proof, fifo: SyncFIFO) -> None:
    """Prove the invariants of a FIFO's registers, which the induction needs."""
    produce = inside(fifo, "produce")[0]
    consume = inside(fifo, "consume")[0]
    ahead   = Signal.like(produce)
    proof.comb += ahead.eq(produce - consume)
    proof.prove("the FIFO's level is its pointers' distance",
                (fifo.level <= fifo.depth) & (ahead == fifo.level[:log2_int(fifo.depth)]))


def stored(proof: Proof, fifo: SyncFIFO, place) -> Signal:
    """Return the item in a FIFO `place` items after the next one out: payload, first, last."""
    memory  = next(special for special in fifo._fragment.specials if isinstance(special, Memory))
    port    = memory.get_port(async_read=True)
    address = Signal(log2_int(fifo.depth))
    proof.specials += port
    proof.comb += [address.eq(inside(fifo, "consume")[0] + place), port.adr.eq(address)]
    return port.dat_r


def queue(proof: Proof, push, item, pop, depth: int) -> tuple[list[Signal], Signal]:
    """Return the items pushed and not yet popped, the oldest first, and their count.

    This defines "in order, none lost and none twice": a core that passes items on offers the first of these.
    """
    width = Signal(max(len(item), 1))
    items = [Signal.like(width) for _ in range(depth)]
    level = Signal(max=depth + 2)
    after = Signal.like(level)
    proof.comb += [width.eq(item), after.eq(level - pop)]
    proof.sync += [
        If(pop,
            [here.eq(behind) for here, behind in zip(items, items[1:], strict=False)]
        ),
        [If(push & (after == place),
            items[place].eq(width)
        ) for place in range(depth)],
        level.eq(after + push),
    ]
    return items, level


def all_of(endpoint: Endpoint) -> Cat:
    """Return payload, parameters and marks of an endpoint."""
    return Cat(*endpoint.payload.flatten(), *endpoint.param.flatten(), endpoint.first, endpoint.last)
