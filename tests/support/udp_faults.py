#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a bad network does to the datagrams of one direction, drawn from a seeded generator."""

from __future__ import annotations

import random
import time
from dataclasses import dataclass, field
from typing import Any

from .pairs import byte_generator

#: Seconds after which a delayed datagram leaves, even if too few others have overtaken it.
HOLD_S = 0.005


@dataclass
class _Held:
    to:        Any
    datagram:  bytes
    overtakes: int #: number of others that will overtake it
    since:     float


@dataclass
class Faults:
    """Chances per datagram, and counts of each fault.

    A reordered datagram is overtaken by 1 to `distance` others. `carried` counts the datagrams that entered.
    """

    loss:        float = 0.0
    duplication: float = 0.0
    reordering:  float = 0.0
    flips:       float = 0.0
    distance:    int   = 32
    rng:         random.Random = field(default_factory=random.Random)
    carried:     int   = 0
    lost:        int   = 0
    duplicated:  int   = 0
    reordered:   int   = 0
    flipped:     int   = 0
    held:        list[_Held] = field(default_factory=list)

    def carry(self, to: Any, datagram: bytes) -> list[tuple[Any, bytes]]:
        """Return the datagrams that leave the network when one enters it, each with its destination."""
        self.carried += 1
        if self._happens("lost", self.loss):
            return self._passed([])
        copies = [datagram, datagram] if self._happens("duplicated", self.duplication) else [datagram]
        out    = []
        for copy in copies:
            if datagram and self._happens("flipped", self.flips):
                bit  = self.rng.randrange(8*len(copy))
                copy = copy[:bit // 8] + bytes([copy[bit // 8] ^ 1 << bit % 8]) + copy[bit // 8 + 1:]
            if self._happens("reordered", self.reordering):
                self.held.append(_Held(to, copy, self.rng.randint(1, self.distance), time.monotonic()))
            else:
                out.append((to, copy))
        return self._passed(out)

    def _happens(self, fault: str, chance: float) -> bool:
        happens = self.rng.random() < chance
        setattr(self, fault, getattr(self, fault) + happens)
        return happens

    def _passed(self, out: list[tuple[Any, bytes]]) -> list[tuple[Any, bytes]]:
        for held in self.held:
            held.overtakes -= len(out)
        return out + self._let_go(lambda held: held.overtakes <= 0)

    def overdue(self) -> list[tuple[Any, bytes]]:
        """Return the datagrams that leave the network because they have been held for long enough."""
        now = time.monotonic()
        return self._let_go(lambda held: now - held.since > HOLD_S)

    def _let_go(self, free: Any) -> list[tuple[Any, bytes]]:
        out       = [(held.to, held.datagram) for held in self.held if free(held)]
        self.held = [held for held in self.held if not free(held)]
        return out


def bad_ways(*salt: int, loss: float = 0.05, duplication: float = 0.05, reordering: float = 0.1, flips: float = 0.01
             ) -> list[Faults]:
    """Return a bad direction to the device, and one back, whose generators differ."""
    return [Faults(loss, duplication, reordering, flips, rng=byte_generator(*salt, way)) for way in (0, 1)]
