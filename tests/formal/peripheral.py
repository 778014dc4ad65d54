#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""StereoPeripheral: what software can do to it through its registers, and what it cannot."""

from __future__ import annotations

from litex.gen import LiteXModule
from litex.soc.interconnect import csr_bus
from migen import Cat, If, Signal

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.matcher.frame_settings import REGISTERS, frame_settings
from litestereo.gateware.peripherals.stereo_peripheral import StereoPeripheral

from . import memory
from .proof import Proof, inside
from .streams import counted

SMALL = MatcherParameters(max_width=32, disparities=16, max_block_size=5, features={"raw"})


class Registered(LiteXModule):
    """A small peripheral, and its registers on a bus."""

    def __init__(self, make=StereoPeripheral) -> None:
        self.read       = memory.port()
        self.write      = memory.port()
        self.peripheral = make(self.read, self.write, SMALL, burst_bytes=8)
        self.bus  = csr_bus.Interface(data_width=32, address_width=14)
        self.bank = csr_bus.CSRBank(self.peripheral.get_csrs(), bus=self.bus)

    def written(self, register) -> Signal:
        """Return whether software writes the register in this clock."""
        parts  = register.simple_csrs if hasattr(register, "simple_csrs") else [register]
        places = [self.bank.simple_csrs.index(part) for part in parts]
        return self.bus.we & (self.bus.adr[9:] == 0) & (self.bus.adr[:9] == places[0])


def peripheral(make=StereoPeripheral) -> Proof:
    """Prove any accesses to the registers, any memory, any stream of pairs."""
    top   = Registered(make)
    core  = top.peripheral
    proof = Proof(top)
    for bus in (top.read, top.write):
        memory.slave(proof, bus)
    proof.free(top.bus.adr, top.bus.we, top.bus.re, top.bus.dat_w, core.pairs.valid, core.pairs.last,
               core.pairs.left, core.pairs.right)
    ev = core.ev

    # Registers.
    storages = {name: getattr(core, f"_{name}") for name, *_ in REGISTERS}
    for name, storage in {**storages, "options": core._options, "enable": ev.enable}.items():
        proof.prove(f"{name} changes by its own write alone", ~proof.started | proof.past(top.written(storage))
                    | (storage.storage == proof.past(storage.storage)))
    control = proof.past(top.written(core._control))
    value   = proof.past(top.bus.dat_w)
    proof.prove("a frame begins by a write of 1 to start alone", core.start == (control & value[0]))
    proof.prove("it is given up by a write of 1 to abort alone", core.abort == (control & value[1]))

    # Events.
    for bit, (source, event) in enumerate([(ev.done, core.done), (ev.error, core.failed)]):
        # LiteX clears an event a clock after the write.
        cleared = proof.past(proof.past(top.written(ev.pending) & top.bus.dat_w[bit]))
        before  = proof.past(source.pending)
        proof.prove(f"event {bit} pends when it has been, until a 1 is written",
                    ~proof.started | (source.pending == (proof.past(event) | (before & ~cleared))))
    pending = Cat(ev.done.pending, ev.error.pending)
    proof.prove("the interrupt is an event that is enabled", ev.irq == ((pending & ev.enable.storage) != 0))

    # Frames.
    begun  = proof.past(core.start & ~core.busy)
    before = proof.past(core.busy)
    ends   = core.done | core.failed
    proof.prove("done and failed exclude each other", ~(core.done & core.failed))
    proof.prove("a frame ends once, with one of them",
                ~proof.started | (core.busy == (begun | (before & ~proof.past(ends)))))
    proof.prove("neither without a frame", ~ends | core.busy)
    proof.prove("done counts", ~proof.started | (core.frames == proof.past(core.frames) + proof.past(core.done)))
    proof.prove("how it ended holds until the next begin", begun | ~proof.started | proof.past(core.failed)
                | (core.error_code == proof.past(core.error_code)))
    proof.prove("a frame that failed says why", ~proof.past(core.failed) | (core.error_code != 0))
    for name, _ in frame_settings():
        taken = getattr(core.frame, name)
        proof.prove(f"{name} of a frame holds until the next", begun | ~proof.started | (taken == proof.past(taken)))

    # Memory.
    fsm     = core.fsm
    waiting = (fsm.state == fsm.encoding["IDLE"]) | (fsm.state == fsm.encoding["CHECK"])
    proof.prove("DMA begins with legal settings alone", ~(core.reader.start | core.writer.start)
                | proof.past(core.frame.legal))
    proof.prove("memory is left alone without a frame", core.busy | ~(top.read.stb | top.write.stb))
    proof.prove("a frame that was streamed reads no memory", ~core.frame.streamed | ~core.reader.start)
    proof.reach("a frame is refused, and its event cleared",
                counted(proof, core.failed, 0, 2)[0] & ~ev.error.pending & ~core.busy)
    # Invariants, for the induction.
    proof.prove("five states", fsm.state < 5)
    proof.prove("DMA is idle meanwhile", ~waiting | (core.reader.idle & core.writer.idle))
    proof.prove("DMA's states", (core.reader.fsm.state < 6) & (core.writer.fsm.state < 5))
    code = Signal(4)
    proof.comb += If(fsm.state == fsm.encoding["STOP"], code.eq(inside(core, "next_code")[0])).Else(code.eq(1))
    proof.prove("why is known when it stops", code != 0)
    return proof
