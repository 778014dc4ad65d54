#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The CSR bus with registers: each access reaches its register alone, once, and reads what the register has."""

from __future__ import annotations

import re

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import csr_bus
from litex.soc.interconnect.csr import CSR, AutoCSR, CSRStatus, CSRStorage
from migen import Memory, Signal

from litestereo.sim.cores.pin_core import PinCore
from litestereo.soc.boards import BOARDS, soc_class
from litestereo.soc.boards.board_soc import UNPIPELINED_HZ
from litestereo.soc.parts.csr_registers import CSRBridge, RegisteredBanks
from support.pairs import byte_generator

REGISTERS = 5    # Of each bank.
WORDS     = 8    # Of the memory of the last one.
PAGE      = 0x800


class Bank(LiteXModule, AutoCSR):
    """Registers that software writes, registers that it reads, and one that acts on each access."""
    def __init__(self):
        self.values = []
        self.seen   = []
        for index in range(REGISTERS):
            storage, status = CSRStorage(32, name=f"storage{index}"), CSRStatus(32, name=f"status{index}")
            setattr(self, f"storage{index}", storage)
            setattr(self, f"status{index}", status)
            value, seen = Signal(32), Signal(8)
            self.comb += status.status.eq(value)
            self.sync += seen.eq(seen + storage.re)
            self.values.append(value)
            self.seen.append((storage.storage, seen))
        self.action           = CSR(8)
        self.reads, self.writes = Signal(8), Signal(8)
        self.comb += self.action.w.eq(self.reads)
        self.sync += [self.reads.eq(self.reads + self.action.we), self.writes.eq(self.writes + self.action.re)]


class Top(LiteXModule):
    """Banks 0, 1 and 5, and a memory, behind the bridge."""
    def __init__(self):
        self.first, self.second, self.third = Bank(), Bank(), Bank()
        numbers     = {"first": 0, "second": 1, "third": 5}
        self.memory = Memory(32, WORDS)
        self.third.get_memories = lambda: [(False, self.memory)]
        self.specials += self.memory
        self.bridge = CSRBridge(32, csr_bus.Interface(data_width=32, address_width=14))
        self.banks  = RegisteredBanks(self, lambda name, memory: 6 if memory else numbers[name],
                                      data_width=32, address_width=14, paging=PAGE)
        self.shared = csr_bus.InterconnectShared([self.bridge.csr], self.banks.get_buses())


class Bus:
    """The core and its Wishbone, with the registers' places."""
    def __init__(self):
        top, outputs, inputs = Top(), {}, {}
        for name in ("first", "second", "third"):
            bank = getattr(top, name)
            for index in range(REGISTERS):
                inputs[f"{name}_value{index}"] = bank.values[index]
                outputs[f"{name}_storage{index}"], outputs[f"{name}_seen{index}"] = bank.seen[index]
            outputs |= {f"{name}_reads": bank.reads, f"{name}_writes": bank.writes}
        bus       = top.bridge.wishbone
        inputs   |= {name: getattr(bus, name) for name in ("adr", "dat_w", "sel", "we", "cyc", "stb")}
        outputs  |= {"ack": bus.ack, "dat_r": bus.dat_r}
        self.core = PinCore(top, inputs, outputs)
        # LiteX numbers the words of a CSRStorage.
        self.places = {(name, re.sub(r"(storage\d)0", r"\1", csr.name)): number*PAGE//4 + index
                       for name, csrs, number, rmap in top.banks.banks for index, csr in enumerate(rmap.simple_csrs)}
        self.memory = 6*PAGE//4

    def access(self, address, data=None, sel=15):
        """Read or write a word; return what was read, and the clocks of the access."""
        core = self.core
        core.set(adr=address, dat_w=data or 0, sel=sel, we=int(data is not None), cyc=1, stb=1)
        for clocks in range(20):
            if core.get("ack"):
                read = core.get("dat_r")
                core.clock()
                core.set(cyc=0, stb=0, we=0)
                return read, clocks + 1
            core.clock()
        raise AssertionError("no answer")


@pytest.fixture(scope="module")
def bus():
    made = Bus()
    yield made
    made.core.close()


def test_accesses(bus):
    """Drawn accesses, with and without clocks between them: exactly one register sees each, exactly once."""
    rng    = byte_generator(19)
    core   = bus.core
    stored = dict.fromkeys(((bank, index) for bank in ("first", "second", "third") for index in range(REGISTERS)), 0)
    seen   = dict.fromkeys(stored, 0)
    acted  = dict.fromkeys(("first", "second", "third"), [0, 0])
    words  = list(range(1, WORDS + 1))
    for word, value in enumerate(words):
        bus.access(bus.memory + word, value)
    for _ in range(600):
        bank, index = rng.choice(list(stored))
        value       = rng.getrandbits(32)
        kind        = rng.choice(("write", "read", "status", "act", "peek", "memory", "store", "nothing"))
        if kind == "write":
            bus.access(bus.places[bank, f"storage{index}"], value)
            stored[bank, index] = value
            seen[bank, index]   = (seen[bank, index] + 1) % 256
        elif kind == "read":
            assert bus.access(bus.places[bank, f"storage{index}"])[0] == stored[bank, index]
        elif kind == "status":
            core.set(**{f"{bank}_value{index}": value})
            assert bus.access(bus.places[bank, f"status{index}"]) == (value, 5)
        elif kind == "act":
            bus.access(bus.places[bank, "action"], value)
            acted[bank] = [acted[bank][0], (acted[bank][1] + 1) % 256]
        elif kind == "peek":
            assert bus.access(bus.places[bank, "action"])[0] == acted[bank][0]
            acted[bank] = [(acted[bank][0] + 1) % 256, acted[bank][1]]
        elif kind == "memory":
            word = rng.randrange(WORDS)
            assert bus.access(bus.memory + word)[0] == words[word]
        elif kind == "store":
            word = rng.randrange(WORDS)
            bus.access(bus.memory + word, value)
            words[word] = value
        else: # Without a byte selected, and where there is no bank.
            bus.access(bus.places[bank, f"storage{index}"], value, sel=0)
            assert bus.access(3*PAGE//4 + rng.randrange(PAGE//4))[0] == 0
        for _ in range(rng.choice((0, 0, 1, 3))):
            core.clock()
        core.clock()
        for (name, number), expected in stored.items():
            assert core.get(f"{name}_storage{number}") == expected
            assert core.get(f"{name}_seen{number}") == seen[name, number]
        for name, expected in acted.items():
            assert [core.get(f"{name}_reads"), core.get(f"{name}_writes")] == expected


@pytest.mark.parametrize("board", BOARDS)
def test_boards(board):
    """A board whose clock is fast has the registers, others have none: they cost clocks."""
    cls = soc_class(board)
    soc = cls(cls.preset)
    soc.finalize()
    assert soc.csr_registers == (cls.preset.sys_clk_freq > UNPIPELINED_HZ)
    assert isinstance(soc.csr_bridge, CSRBridge) == soc.csr_registers
    assert isinstance(soc.csr_bankarray, RegisteredBanks) == soc.csr_registers
    assert type(soc.csr_bankarray) in (RegisteredBanks, csr_bus.CSRBankArray)
