#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Wishbone: what a slave may do, and what a master must do."""

from __future__ import annotations

from litex.soc.interconnect import wishbone
from migen import Cat, Signal

from .proof import Proof
from .streams import counted

#: Bytes per word of the port, in all proofs.
WORD = 4


def port() -> wishbone.Interface:
    """Return a port with few address bits: the arithmetic is the same, and the solver is faster."""
    return wishbone.Interface(data_width=8*WORD, address_width=32, addressing="word")


def slave(proof: Proof, bus: wishbone.Interface) -> Signal:
    """Add a slave that answers at any time, with data or an error; return whether it answers."""
    proof.free(bus.ack, bus.err, bus.dat_r)
    answer = Signal()
    proof.comb += answer.eq(bus.ack | bus.err)
    proof.assume("answers come to requests only", ~answer | (bus.cyc & bus.stb))
    return answer


def master(proof: Proof, bus: wishbone.Interface, answer: Signal) -> None:
    """Prove that a request is stable until it is answered, and is of whole words."""
    request = Cat(bus.cyc, bus.stb, bus.we, bus.adr, bus.dat_w, bus.sel)
    before  = Signal(len(request))
    waiting = Signal()
    proof.sync += [before.eq(request), waiting.eq(bus.stb & ~answer)]
    proof.prove("a request stays until it is answered", ~waiting | (request == before))
    proof.prove("requests are of whole words", ~bus.stb | (bus.cyc & (bus.sel == 2**WORD - 1)))


def in_order(proof: Proof, bus: wishbone.Interface, answer: Signal, base: Signal, words, begin,
             bits: int = 16) -> Signal:
    """Prove that a block's words are requested in order, each once, and none outside; return how many are answered.

    `words` is the length of the block; the count has `bits`.
    """
    count = counted(proof, bus.stb & answer, begin, bits)
    index = Signal(30)
    proof.comb += index.eq(bus.adr - base[2:])
    proof.prove("addresses go from base up, each once", ~bus.stb | (index == count))
    proof.prove("no address outside of [base, base + length)", ~bus.stb | (index < words))
    return count
