#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Two sensors in front of their guards, clock by clock of the system, and what takes their pairs."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from litestereo.gateware.cameras.layouts import FRAME_BEGIN, FRAME_END, PIXEL, ROW_END

from .dvp import Rows

#: Room of a crossing in items, and clocks from the start of a frame until its first item is at the guard.
CROSSING_ITEMS = 32
CROSSING_DELAY = 5

#: An item: kind, pixel, whether items in front of it were lost.
Item = tuple[int, int, int]


@dataclass
class Shown:
    """A frame as a sensor shows it: its rows, and times in clocks."""
    rows:     Rows
    period:   int                    #: from its start to the start of the next one
    blanking: int  = 6               #: in front of each row, and after the last one
    pace:     int  = 2               #: from pixel to pixel
    hidden:   bool = False           #: its start is seen, its first item is lost
    stop:     int | None = None      #: clock of the frame at which the sensor falls silent until the next one

    def items(self) -> list[Item | None]:
        """Return the item of each clock."""
        result: list[Item | None] = [None if self.hidden else (FRAME_BEGIN, 0, 0)]
        for row in self.rows:
            result += [None]*self.blanking
            for pixel in row:
                result += [(PIXEL, pixel, 0)] + [None]*(self.pace - 1)
            result.append((ROW_END, 0, 0))
        result += [None]*self.blanking + [(FRAME_END, 0, 0)]
        if self.stop is not None:
            result = result[:self.stop]
        return (result + [None]*self.period)[:max(self.period, len(result))]


@dataclass
class SensorSide:
    """One sensor and its crossing.

    Parameters
    ----------
    frames
        What it shows.
    delay
        Clocks until it begins.
    """
    frames: Iterable[Shown | int]
    delay:  int = 0
    starts: dict[int, Shown] = field(default_factory=dict)    #: frames that have begun, by the clock of their start
    now:    int = 0
    done:   bool = False

    def __post_init__(self) -> None:
        self._frames  = iter(self.frames)
        self._script: deque[Item | None] = deque([None]*self.delay)
        self._waiting: deque[tuple[int, Item]] = deque()
        self._lost    = 0

    def step(self, clock: int) -> bool:
        """Show the next clock; return whether a frame starts."""
        starts = False
        while not self._script and not self.done:
            frame = next(self._frames, None)
            if frame is None:
                self.done = True
            elif isinstance(frame, int):
                self._script.extend([None]*frame)
            else:
                self._script.extend(frame.items())
                self.starts[clock] = frame
                starts = True
        item = self._script.popleft() if self._script else None
        if starts and self.starts[clock].hidden:
            self._lost = 1
        if item is not None:
            if len(self._waiting) < CROSSING_ITEMS:
                self._waiting.append((clock + CROSSING_DELAY, (*item[:2], self._lost)))
                self._lost = 0
            else:
                self._lost = 1
        return starts

    def offer(self, clock: int) -> Item | None:
        """Return the item at the guard, if there is one."""
        return self._waiting[0][1] if self._waiting and self._waiting[0][0] <= clock else None

    def take(self) -> None:
        """Take it."""
        self._waiting.popleft()

    @property
    def idle(self) -> bool:
        """Return whether there is nothing to come."""
        return self.done and not self._script and not self._waiting


@dataclass
class Follower:
    """What takes pairs, a frame each time that it is open.

    Parameters
    ----------
    ready
        Chance that it takes a pair in a clock.
    pause
        Least and most clocks for which it is closed between frames.
    """
    rng:   random.Random
    ready: float = 1.0
    pause: tuple[int, int] = (1, 3)
    open:  bool = True
    given: list[tuple[int, int]] = field(default_factory=list)
    _wait: int = 0

    def step(self) -> None:
        """Go on to the next clock."""
        if not self.open and self._wait == 0:
            self.open = True
        self._wait -= self._wait > 0

    def close(self) -> None:
        """Close for a pause."""
        self.open  = False
        self._wait = self.rng.randint(*self.pause)
