#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Two clocks of any ratio and phase, either of which may be stopped, and their resets."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Side:
    """A clock domain: `edge` makes an edge of its clock, `reset` sets its reset."""
    edge:    Callable[[], None]
    reset:   Callable[[int], None]
    period:  float = 1.0
    due:     float = 0.0
    stopped: bool  = False
    held:    int   = 0     #: edges for which the reset still lasts after its end
    resets:  bool  = False #: the reset is set
    edges:   int   = 0     #: since the reset ended
    listens: bool  = True  #: sees its reset; otherwise that passes while the clock is stopped


@dataclass
class TwoClocks:
    """The sides `one` and `other`, and the time, in periods."""
    one:   Side
    other: Side
    rng:   random.Random
    now:   float = 0.0
    under_reset: bool = field(default=False)

    def draw(self) -> None:
        """Draw ratio and phases."""
        for side in (self.one, self.other):
            side.period = self.rng.choice([1.0, self.rng.uniform(0.3, 3.0)])
            side.due    = self.now + self.rng.random()*side.period

    def run(self, duration: float) -> None:
        """Make all edges of a duration."""
        end = self.now + duration
        while True:
            side = min((self.one, self.other), key=lambda one: one.due)
            if side.due > end:
                break
            self.now  = side.due
            side.due += side.period
            if not side.stopped:
                side.edge()
                side.edges += not side.resets
                if side.resets and not self.under_reset:
                    side.held -= 1
                    if side.held <= 0:
                        side.resets = False
                        side.edges  = 0
                        side.reset(0)
        self.now = end

    def reset(self) -> None:
        """Assert both resets, without a clock."""
        self.under_reset = True
        for side in (self.one, self.other):
            side.resets = True
            side.reset(1)

    def release(self) -> None:
        """End both resets: each lasts for two more edges of its clock, as a synchronizer of resets makes it."""
        self.under_reset = False
        for side in (self.one, self.other):
            side.held = 2
            if not side.listens:
                side.resets = False
                side.edges  = 0
                side.reset(0)

    def reset_without(self, side: Side) -> None:
        """Reset both sides, while the clock of one is stopped for any part of it, or around it."""
        first, last = sorted(self.rng.sample(range(4), 2))
        if not side.listens:
            first, last = 0, 3
        for step, action in enumerate((lambda: None, self.reset, self.release, lambda: None)):
            if step == first:
                side.stopped = True
            action()
            if step == last:
                side.stopped = False
            self.run(self.rng.choice([2.0, self.rng.uniform(6.0, 60.0)]) if step else self.rng.uniform(0.0, 5.0))
        side.stopped = False
