#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Values at and around every limit of a range, for drawn tests and for tests of refusals."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from litestereo.host_tools.core.settings_table import RULES

Rng = random.Random | np.random.Generator

#: Draws of a range within which each of its ends is drawn.
BLOCK = 12

#: Largest values of any device, where each has its own limit. The gateware's table needs migen, which the ends of the
#: host package are without.
ANY_DEVICE = {"disparities": 256, "block_size": 255}

#: Draws of a block that are the ends, and powers of two or their neighbours; a draw is uniform, the others are usual.
ENDS, POWERS = 4, 3


@dataclass(frozen=True)
class Range:
    """A range of integers: from `least` to `most`, both legal, in steps of `step`."""
    least: int
    most:  int
    step:  int = 1

    def __contains__(self, value: int) -> bool:
        return self.least <= value <= self.most and (value - self.least) % self.step == 0

    @property
    def ends(self) -> list[int]:
        """The lowest value, the one above it, the one below the highest value, and the highest one."""
        last = self.most - (self.most - self.least) % self.step
        return self._legal([self.least, self.least + self.step, last - self.step, last])

    @property
    def powers(self) -> list[int]:
        """Each power of two, of either sign, and the values next to it, as far as they are in the range."""
        size  = max(abs(self.least), abs(self.most), 1).bit_length() + 1
        found = []
        for power in (sign << bit for sign in (1, -1) for bit in range(size)):
            above  = (power - self.least) % self.step  # How far it is above the next lower value.
            found += [power - above + offset*self.step for offset in ((-1, 0, 1) if above == 0 else (0, 1))]
        return self._legal(found)

    @property
    def limits(self) -> list[int]:
        """All of these."""
        return self._legal([*self.ends, *self.powers])

    def beyond(self, lowest: int | None = None, highest: int | None = None) -> list[int]:
        """Return the first illegal values on each side and between the steps, and the extremes of the field.

        Parameters
        ----------
        lowest, highest
            Extremes that a field holds; values outside of them are left out.
        """
        values  = [self.least - 1, self.least - self.step, self.ends[-1] + 1, self.ends[-1] + self.step]
        values += [end + offset for end in self.ends for offset in (-1, 1)]
        values += [value for value in (lowest, highest) if value is not None]
        return sorted({value for value in values if value not in self
                       and (lowest is None or value >= lowest) and (highest is None or value <= highest)})

    def draw(self, rng: random.Random) -> int:
        """Draw any value, all with the same chance."""
        return rng.randrange(self.least, self.most + 1, self.step)

    def _legal(self, values: Iterable[int]) -> list[int]:
        return sorted({value for value in values if value in self})


class Draws:
    """Draw values of ranges by their names.

    In each block of twelve draws of a name are the ends of its range, three powers of two or their neighbours, a value
    that may be any, and for the rest usual ones, in random order. All powers are drawn before one is drawn again.

    Parameters
    ----------
    rng
        It seeds the draws.
    ranges
        The ranges.
    usual
        Values that a test needs often, as most others switch something off or make it certain; without them any value.
    """
    def __init__(self, rng: Rng, ranges: Mapping[str, Range], usual: Mapping[str, Sequence[int]] | None = None) -> None:
        self.rng    = seeded(rng)
        self.ranges = dict(ranges)
        self.drawn  = {name: Counter[int]() for name in ranges}
        self._usual  = dict(usual or {})
        self._blocks = {name: self._values(name) for name in ranges}

    def __call__(self, name: str) -> int:
        """Draw a value of the range of that name."""
        value = next(self._blocks[name])
        self.drawn[name][value] += 1
        return value

    def missed(self, powers: bool = False) -> dict[str, list[int]]:
        """Return the ends that were not drawn, and with `powers` the powers of two and their neighbours, by name."""
        wanted = {name: one.limits if powers else one.ends for name, one in self.ranges.items()}
        return {name: left for name, values in wanted.items()
                if (left := [value for value in values if not self.drawn[name][value]])}

    def check(self) -> None:
        """Assert that each range has been drawn at all of its ends: at the end of each test that draws."""
        assert not self.missed(), f"not drawn: {self.missed()}"

    def _values(self, name: str) -> Iterator[int]:
        one    = self.ranges[name]
        usual  = self._usual.get(name)
        powers = self._rounds(one.powers)
        while True:
            block  = [*one.ends, *(next(powers, one.draw(self.rng)) for _ in range(POWERS)), one.draw(self.rng)]
            block += [self.rng.choice(usual) if usual else one.draw(self.rng) for _ in range(BLOCK - len(block))]
            self.rng.shuffle(block)
            yield from block

    def _rounds(self, values: list[int]) -> Iterator[int]:
        while values:
            yield from self.rng.sample(values, len(values))


def seeded(rng: Rng) -> random.Random:
    """Return a Python generator that another one seeds."""
    return random.Random(rng.getrandbits(64) if isinstance(rng, random.Random) else int(rng.integers(1 << 63)))


def setting_ranges(**most: int) -> dict[str, Range]:
    """Return the range of each setting, from the table of the settings; `most` narrows some, as a device does."""
    largest = {name: rule.most if rule.most is not None else ANY_DEVICE[name] for name, rule in RULES.items()}
    return {name: Range(rule.least, min(largest[name], most.get(name, largest[name])), rule.step)
            for name, rule in RULES.items()}
