#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A pipeline core that gets whole frames, and whose items are checked one by one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.sim.cores.stream_core import StreamCore

from .lanes import pack, unpack
from .pairs import SEED

#: A small matcher with all features.
SMALL = MatcherParameters(max_width=44, max_height=100, disparities=16, max_block_size=9)

Fields = dict[str, NDArray[np.int64]]


class CoreBench:
    """Simulate a core's emitted Verilog, with fields of items by name.

    Parameters
    ----------
    core
        Core with a `sink` and a `source`.
    settings
        Names of the Signals that `set` drives.
    lanes
        Number of lanes of those fields of the source that have several.
    pipeline
        The core never stalls.
    """

    def __init__(self, core, settings: Sequence[str] = (), lanes: dict[str, int] | None = None,
                 pipeline: bool = True) -> None:
        self.module = core
        self.core   = StreamCore(core, settings, pipeline=pipeline)
        self.lanes  = lanes

    def set(self, **settings: int) -> None:
        """Drive settings, and wait until the thresholds that the core derives from them are valid."""
        self.core.set(**settings)
        self.settle()

    def settle(self, clocks: int = 6) -> None:
        """Run some idle clocks."""
        self.core.run(np.zeros((0, self.core.sink_words), np.uint32), 1, idle_clocks=clocks)

    def begin(self, **settings: int) -> None:
        """Drive settings, then a pulse on `begin`."""
        self.set(begin=0, **settings)
        self.core.set(begin=1)
        self.settle(1)
        self.core.set(begin=0)

    def run(self, fields: Fields, outputs: int, valid: float = 1.0, ready: float = 1.0) -> Fields:
        """Run a frame, and return its items, of which there must be `outputs`."""
        result = self.core.run(pack(self.module.sink, fields), outputs + 1, valid=valid, ready=ready, seed=SEED,
                               idle_clocks=3000)
        assert len(result.words) == outputs
        self.marks = result.first, result.last
        self.taken = result.accepted
        return unpack(self.module.source, result.words, self.lanes)

    def interrupt(self, fields: Fields, clock: int) -> None:
        """Reset the core in the middle of a frame."""
        words = pack(self.module.sink, fields)
        self.core.run(words, len(words), valid=0.7, seed=SEED, reset_clock=clock)
        self.core.reset()
        self.settle()
