#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A memory for the ports of a core in Verilator, which stalls at random and checks the protocol of its masters."""

from __future__ import annotations

import random
from collections import deque

from litedram.common import LiteDRAMNativePort
from litex.soc.interconnect import wishbone


def port_pins(prefix: str, port) -> tuple[dict, dict]:
    """Return inputs and outputs of a core for one memory port, by the names that the memory models use."""
    if isinstance(port, wishbone.Interface):
        return ({f"{prefix}_{name}": getattr(port, name) for name in ("dat_r", "ack", "err")},
                {f"{prefix}_{name}": getattr(port, name) for name in ("adr", "dat_w", "sel", "cyc", "stb", "we")})
    if not isinstance(port, LiteDRAMNativePort):
        raise TypeError(f"no model for a port of type {type(port).__name__}")
    return ({f"{prefix}_cmd_ready": port.cmd.ready, f"{prefix}_wdata_ready": port.wdata.ready,
             f"{prefix}_rdata_valid": port.rdata.valid, f"{prefix}_rdata_data": port.rdata.data},
            {f"{prefix}_cmd_valid": port.cmd.valid, f"{prefix}_cmd_we": port.cmd.we,
             f"{prefix}_cmd_addr": port.cmd.addr,
             f"{prefix}_wdata_valid": port.wdata.valid, f"{prefix}_wdata_data": port.wdata.data,
             f"{prefix}_wdata_we": port.wdata.we, f"{prefix}_rdata_ready": port.rdata.ready})


class Memory:
    """Bytes, and a record of the words that were accessed.

    `speed` is the chance per clock that the memory advances: at 1.0 it never waits.
    """
    def __init__(self, size: int, word_bytes: int, rng: random.Random, speed: float = 1.0) -> None:
        self.bytes      = bytearray(rng.randbytes(size))
        self.word_bytes = word_bytes
        self.rng        = rng
        self.speed      = speed
        self.fail_after = None  #: accesses until one is answered with an error; None: no error
        self.reads:  list[int] = []
        self.writes: list[int] = []

    def goes(self) -> bool:
        """Return whether the memory advances in this clock."""
        return self.rng.random() < self.speed

    def fails(self) -> bool:
        """Return whether this access fails."""
        if self.fail_after is None:
            return False
        self.fail_after -= 1
        return self.fail_after < 0

    def read(self, word: int) -> int:
        """Return a word; addresses above the end wrap, as the address bits of a real memory do."""
        start = word*self.word_bytes % len(self.bytes)
        self.reads.append(start)
        return int.from_bytes(self.bytes[start:start + self.word_bytes], "little")

    def write(self, word: int, value: int) -> None:
        """Write a whole word."""
        start = word*self.word_bytes % len(self.bytes)
        self.writes.append(start)
        self.bytes[start:start + self.word_bytes] = value.to_bytes(self.word_bytes, "little")


class Slave:
    """What both kinds of port share: pins by their short names."""
    def __init__(self, core, prefix: str, memory: Memory) -> None:
        self.core, self.prefix, self.memory = core, prefix, memory
        self.reset()

    def get(self, name: str) -> int:
        """Return the value of the master's pin."""
        return self.core.get(f"{self.prefix}_{name}")

    def put(self, **values: int) -> None:
        """Drive pins to the master."""
        self.core.set(**{f"{self.prefix}_{name}": value for name, value in values.items()})


class WishboneSlave(Slave):
    """A Wishbone slave. Classic cycles: a started access is stable until it is answered."""

    def reset(self) -> None:
        """Forget an access that a reset has aborted."""
        self.open: tuple[int, int] | None = None

    def step(self) -> None:
        """Answer or stall; called before each rising edge."""
        request = (self.get("adr"), self.get("we")) if self.get("cyc") and self.get("stb") else None
        assert self.open in (None, request), "the master let go of an access that was not answered"
        self.open = request
        answer = {"ack": 0, "err": 0, "dat_r": self.memory.rng.getrandbits(8*self.memory.word_bytes)}
        if request and self.memory.goes():
            self.open = None
            word, writes = request
            if self.memory.fails():
                answer["err"] = 1
            else:
                answer["ack"] = 1
                if writes:
                    assert self.get("sel") == 2**self.memory.word_bytes - 1
                    self.memory.write(word, self.get("dat_w"))
                else:
                    answer["dat_r"] = self.memory.read(word)
        self.put(**answer)


class NativeSlave(Slave):
    """A LiteDRAM native port: commands queue, data follow in order, and read data do not wait."""
    def reset(self) -> None:
        """Forget all that a reset has aborted."""
        self.reads:  deque[int] = deque()
        self.writes: deque[int] = deque()
        self.held: tuple[int, int] | None = None

    def step(self) -> None:
        """Accept commands and transfer data; called before each rising edge."""
        # Data of commands from earlier clocks.
        moves_read  = bool(self.reads) and self.memory.goes()
        moves_write = bool(self.writes) and self.memory.goes()
        self.put(rdata_valid=moves_read, wdata_ready=moves_write,
                 rdata_data=self.memory.read(self.reads.popleft()) if moves_read else 0)
        if moves_read:
            assert self.get("rdata_ready"), "the master did not accept read data"
        if moves_write and self.get("wdata_valid"):
            assert self.get("wdata_we") == 2**self.memory.word_bytes - 1
            self.memory.write(self.writes.popleft(), self.get("wdata_data"))
        # Commands.
        ready = self.memory.goes()
        self.put(cmd_ready=ready)
        command = (self.get("cmd_addr"), self.get("cmd_we")) if self.get("cmd_valid") else None
        assert self.held in (None, command), "the master let go of a command that was not taken"
        self.held = None if ready else command
        if ready and command:
            (self.writes if command[1] else self.reads).append(command[0])


def slave(core, prefix: str, port, memory: Memory) -> WishboneSlave | NativeSlave:
    """Return the model for the kind of the port."""
    return (WishboneSlave if isinstance(port, wishbone.Interface) else NativeSlave)(core, prefix, memory)
