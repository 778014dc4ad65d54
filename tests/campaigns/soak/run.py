#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A host that matches frames while the device is disturbed, and compares every map with the reference model."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.host_tools.devices.base import Device
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings

from .device import Machine
from .frames import Batch, BatchDraws

#: Attempts at a pair until it counts as lost.
MOST_TRIES = 30

#: Most pairs of a batch.
MOST_PAIRS = 64

LINK = LinkSettings(silence_limit_s=3.0, hello_limit_s=30.0)


@dataclass
class Tally:
    """The results of a soak."""
    frames:      int = 0 #: maps received
    wrong:       int = 0 #: maps that differ from the model's
    lost:        int = 0 #: pairs without a map after `MOST_TRIES`
    recoveries:  int = 0 #: failures of the link or of a frame, after which the pairs without a map were sent again
    aborted:     int = 0 #: batches that the host aborted
    vanished:    int = 0 #: times that the host disappeared without a BYE
    streamed:    int = 0 #: maps of streamed frames
    causes:      dict[str, int] = field(default_factory=dict) #: causes of the recoveries


class Host:
    """Draws batches and matches them.

    Parameters
    ----------
    machine
        The device.
    rng
        Generator of all random numbers.
    tick
        Called after each map.
    """
    def __init__(self, machine: Machine, rng: np.random.Generator, tick: Callable[[Tally], None]) -> None:
        self.machine = machine
        self.rng     = rng
        self.draws   = BatchDraws(rng)
        self.tick    = tick
        self.tally   = Tally()
        self.gone:     list[Device]  = []
        self.device:   Device | None = None
        self.streamed  = False

    def run(self, frames: int) -> Tally:
        """Match batches until there are `frames` maps; end early if a map is wrong or a pair is lost."""
        while self.tally.frames < frames and not self.tally.wrong and not self.tally.lost:
            batch = self.draws.batch(int(self.rng.integers(1, MOST_PAIRS + 1)))
            self._surprise(batch)
            self._match(batch)
        self._close()
        return self.tally

    def _connected(self) -> Device:
        if self.device is None:
            self.streamed = bool(self.rng.integers(2)) and self.machine.streams
            self.device   = connect(self.machine.url + ("?mode=streamed" if self.streamed else ""), LINK)
        return self.device

    def _surprise(self, batch: Batch) -> None:
        """Sometimes start something on the host and abandon it."""
        chance = self.rng.random()
        if chance > 0.12:
            return
        try:
            maps = self._connected().stream(batch.pairs, batch.settings)
            for _ in range(int(self.rng.integers(len(batch.pairs)))):
                next(maps)
            if chance < 0.02:
                # The device is not told; its session ends by silence.
                self.gone   = [*self.gone, self._connected()][-4:]
                self.device = None
                self.tally.vanished += 1
            else:
                maps.close()
                self.tally.aborted += 1
                if chance < 0.06:
                    self._close()
        except LiteStereoError as error:
            self._recover(error)

    def _match(self, batch: Batch) -> None:
        done  = 0
        tries = 0
        while done < len(batch.pairs):
            try:
                for result in self._connected().stream(batch.pairs[done:], batch.settings):
                    self.tally.wrong    += not np.array_equal(result.disparity, batch.maps[done])
                    self.tally.frames   += 1
                    self.tally.streamed += self.streamed
                    done                += 1
                    tries                = 0
                    self.tick(self.tally)
            except LiteStereoError as error:
                tries += 1
                self._recover(error)
                if tries == MOST_TRIES:
                    self.tally.lost += 1
                    return

    def _recover(self, error: LiteStereoError) -> None:
        self.tally.recoveries += 1
        cause = f"{type(error).__name__}: {re.sub(r'[0-9]+', 'N', str(error).split(':')[0])}"
        self.tally.causes[cause] = self.tally.causes.get(cause, 0) + 1
        self._close()

    def _close(self) -> None:
        if self.device is not None:
            self.device.close()
            self.device = None
